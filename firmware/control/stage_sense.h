/* SPDX-License-Identifier: MIT */
/*
 * First stage of the current loop: two measured phase currents to a vector, Q15 of the sensors' range. ISR, constant time.
 *
 * The ADC block saturates to +-32767, so any two currents make a vector of length <= 65534 (lib/transform_q15.h).
 */
#ifndef FIRMWARE_CONTROL_STAGE_SENSE_H
#define FIRMWARE_CONTROL_STAGE_SENSE_H

#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop.h"
#include "lib/transform_q15.h"

/* a and b. 5 cycles, and the two reads. */
static inline alphabeta_t sense_ab(const struct fabric *f)
{
    const int32_t a_q15 = f->adc.IA;
    const int32_t b_q15 = f->adc.IB;
    return clarke_q15(a_q15, b_q15);
}

/*
 * Two of three: subtracting the sum of all three from the third leaves minus the sum of the others (enum loop_pair). 7 cycles
 * more than sense_ab().
 */
static inline alphabeta_t sense_pair(const struct current_loop *c, const struct fabric *f)
{
    const int32_t a_q15 = f->adc.IA;
    const int32_t b_q15 = f->adc.IB;
    const int32_t sum_q15 = f->adc.IC + a_q15 + b_q15;
    const int32_t without_b = (int32_t)((uint32_t)c->pair << 1) >> 31;
    return clarke_q15(a_q15 - (sum_q15 & (c->pair >> 31)), b_q15 - (sum_q15 & without_b));
}

#endif
