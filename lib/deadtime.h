/* SPDX-License-Identifier: MIT */
/*
 * Dead-time compensation. While both switches of a leg are off, the current's sign selects the diode: a positive phase current
 * (out of the bridge) pulls the phase low and shortens its on-time by the dead time, a negative one lengthens it. Source: N.
 * Mohan, T. M. Undeland, W. P. Robbins, "Power Electronics", section 8-5 (effect of blanking time).
 */
#ifndef LIB_DEADTIME_H
#define LIB_DEADTIME_H

#include "lib/factors.h"
#include "lib/q15.h"

/** The share for full compensation, and the current at which it starts: 2^9 LSB, 1.6 % of the range. */
#define DEADTIME_FULL     128
#define DEADTIME_KNEE_Q15 512

/**
 * The share of the dead time to add to the on-time, in 1/128: -128 for i <= -knee, 127 for i >= knee - 4, i/4 rounded down
 * between. The slope avoids amplifying noise around zero current, and accounts for the time the current needs there to charge
 * the switches' capacitance.
 * current: any value, in Q15 with `fraction` more bits (0...28). Monotone. Context: any. 1 cycle.
 */
static inline __attribute__((always_inline)) int32_t deadtime_share_q7(int32_t current, unsigned fraction)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE) && defined(__OPTIMIZE__) /* fraction must be seen constant */
    int32_t result;

    __asm__("ssat %0, #8, %1, asr %2" : "=r"(result) : "r"(current), "i"(fraction + DEADTIME_SHIFT));
    return result;
#else
    return q15_clamp(current >> (fraction + DEADTIME_SHIFT), -DEADTIME_FULL, DEADTIME_FULL - 1);
#endif
}

#endif
