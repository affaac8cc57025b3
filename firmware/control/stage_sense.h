/* SPDX-License-Identifier: MIT */
/*
 * First stage of the current loop: two measured phase currents to a vector, Q15 of the sensors' range. ISR, constant time.
 *
 * The ADC block saturates to +-32767, so any two currents make a vector of length <= 65534 (lib/transform_q15.h).
 */
#ifndef FIRMWARE_CONTROL_STAGE_SENSE_H
#define FIRMWARE_CONTROL_STAGE_SENSE_H

#include "drivers/fabric/fabric.h"
#include "lib/transform_q15.h"

/* a and b; what a shunt cannot see the ADC block has replaced (adc_select()). 5 cycles, and the two reads. */
static inline alphabeta_t sense(const struct fabric *f)
{
    const int32_t a_q15 = f->adc.IA;
    const int32_t b_q15 = f->adc.IB;
    return clarke_q15(a_q15, b_q15);
}

#endif
