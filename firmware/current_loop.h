/* SPDX-License-Identifier: MIT */
/*
 * The current loop: the end-of-conversion interrupt, 20 kHz, the most urgent one.
 *
 * Others set references and thresholds (one word each, so no lock is needed) and read results. What the loop believes
 * can be watched in `current_loop` with a debugger while the motor turns.
 */
#ifndef FIRMWARE_CURRENT_LOOP_H
#define FIRMWARE_CURRENT_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/tuning.h"
#include "lib/pi.h"
#include "lib/pll.h"
#include "lib/q15.h"

/* Causes that the loop finds, one bit each: set in `armed` while they count. */
#define TRIP_ENCODER      (1u << 0)
#define TRIP_OVERCURRENT  (1u << 1)
#define TRIP_CURRENT_SUM  (1u << 2)
#define TRIP_OVERVOLTAGE  (1u << 3)
#define TRIP_UNDERVOLTAGE (1u << 4)
#define TRIP_OVERSPEED    (1u << 5)
#define TRIP_ALL          0x3Fu

struct current_loop {
    /* references: written by the slow loop */
    int32_t i_d_ref_q15;
    int32_t i_q_ref_q15;
    /* the last sample, in the rotor's frame and in the phases */
    int32_t i_d_q15;
    int32_t i_q_q15;
    abc_t i_q15;
    int32_t vbus_q15;
    int32_t radius_q15; /* largest voltage that the modulator makes of it */
    uint32_t angle_u16; /* electrical, at the sampling instant */
    /* the voltages that answer it, effective in the next period */
    int32_t v_d_q15;
    int32_t v_q_q15;

    /* state */
    struct pi_q15 pi_d;
    struct pi_q15 pi_q;
    struct pll pll; /* follows the encoder: speed */
    int32_t vbus_recip_q14;
    uint32_t sum_bad_samples; /* consecutive samples whose sum was off */
    uint32_t samples;         /* counts interrupts: the heartbeat */

    /* settings */
    uint32_t encoder_scale_q32; /* electrical turns per count */
    uint32_t encoder_mask;      /* all ones: follow the encoder; 0: the angle is angle_offset_q32 alone */
    uint32_t angle_offset_q32;
    uint32_t integrate_mask;           /* all ones while the bridge is on; 0 keeps the integrators empty */
    uint32_t armed;                    /* TRIP_ bits that count now */
    int32_t x_d_q11, x_q_q11, emf_q12; /* decoupling, see struct tuning */
    int32_t i_trip_q15, i_sum_q15, v_min_q15, v_max_q15, overspeed_w_q15;

    /* what it costs */
    uint32_t cycles; /* of the last interrupt */
    uint32_t cycles_max;
};

extern struct current_loop current_loop;

/* Speed as the decoupling uses it: Q15, 1.0 = TUNING_SPEED_BASE_HZ electrical. Any context. */
static inline int32_t current_loop_w_q15(void)
{
    return q15_sat16(current_loop.pll.speed_q32 >> 13);
}

/* Loads gains and thresholds. Slow loop or thread, bridge off. */
void current_loop_tune(const struct tuning *t);

/* Starts PWM, encoder, ADC and the interrupt, bridge off. False: CorePWM does not run. Thread, once. */
bool current_loop_start(uint32_t encoder_counts);

/* Empties the integrators and references and brings the bus reciprocal up to date. Slow loop, bridge off. */
void current_loop_prepare(void);

#endif
