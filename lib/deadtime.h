/* SPDX-License-Identifier: MIT */
/*
 * Dead-time compensation. While both switches of a leg are off, the current chooses the diode: a positive phase current
 * (out of the bridge) pulls the phase low and costs it the dead time of on-time, a negative one adds it. Source: N. Mohan,
 * T. M. Undeland, W. P. Robbins, "Power Electronics", section 8-5 (effect of blanking time).
 */
#ifndef LIB_DEADTIME_H
#define LIB_DEADTIME_H

#include "lib/q15.h"

/**
 * The on-time to add: +amount for i_q15 >= knee, -amount for i_q15 <= -knee, linear between, knee = 2^knee_shift LSB of
 * current. The slope keeps noise around zero current from being amplified, and stands for the time that the current
 * needs there to charge the switches' capacitance.
 * amount: 0...32767 in any unit of on-time (Q15 of a period, or counts); knee_shift: 1...15. i_q15: any value.
 * Odd to the bit, monotone; rounded to nearest, ties away from 0. Context: any.
 */
static inline int32_t deadtime_comp(int32_t i_q15, int32_t amount, uint32_t knee_shift)
{
    const int32_t knee = (int32_t)(1U << knee_shift);
    const int32_t scaled = q15_clamp(i_q15, -knee, knee) * amount;

    return (scaled + (knee >> 1) + (scaled >> 31)) >> knee_shift;
}

#endif
