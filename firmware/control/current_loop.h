/* SPDX-License-Identifier: MIT */
/*
 * The current loop: the end-of-conversion interrupt, 20 kHz, the most urgent one.
 *
 * The interrupt itself is written in assembly (current_loop_isr.S); current_loop_step.h defines in C what it computes. It
 * works with what the slow loop prepares once a millisecond: gains for the present bus voltage, the feed-forward, thresholds
 * (they stand in the ADC block). What it believes can be watched in the structure while
 * the motor turns.
 *
 * The interrupt breaks into everything else, so whoever is below it takes the structure as volatile: then every access is
 * made, once, and in the order that is written.
 *
 * Inside the loop voltages have a unit of their own, v_q4: sixteenths of a count of half the on-time. So the bus voltage is
 * in the gains, and what the bus can give is a constant.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop_layout.h"
#include "firmware/settings/tuning.h"
#include "lib/pll.h"
#include "lib/q15.h"

/* The d voltage is limited to this, about 3/4 of the circle, so that q always has its share. */
#define LOOP_V_D_MAX_Q4 16384

struct current_loop {
    struct pll pll;            /* angle predicted for the next sample, and speed; of the encoder, electrical */
    uint32_t angle_offset_q32; /* from the encoder's angle to the field's */
    const int32_t *sine;       /* lib/trig.h */
    /* references: written by the slow loop */
    int32_t i_d_ref_q15;
    int32_t i_q_ref_q15;
    /* controllers: v_q4 per LSB of current; 0 while the bridge is off */
    int32_t kp_d_q9;
    int32_t kp_q_q9;
    int32_t integral_d_q9;
    int32_t integral_q_q9;
    int32_t turn_q15; /* by how much the rotor turns until the voltages act, radians */
    int32_t ki_q15;   /* of both axes, per sample */
    /* the last sample in the rotor's frame, and the voltages that answer it, in the rotor's frame when they act */
    int32_t i_d_q15;
    int32_t i_q_q15;
    int32_t v_d_q4;
    int32_t v_q_q4;
    uint32_t encoder_scale_q32; /* electrical turns per count */
    uint32_t status_max;        /* a gate status above this is a fault; all ones while none counts */
    uint16_t circle_q4[512];    /* largest |v_q| beside v_d */

    /* once a millisecond */
    int32_t vbus_q15;
    int32_t v_d_q15, v_q_q15; /* the voltages, 1.0 = v_range */
    int32_t radius_q15;       /* largest voltage that the modulator makes of the bus */
    int32_t feedforward_d_q4, feedforward_q_q4;
};

/* Speed as the decoupling uses it: Q15, 1.0 = TUNING_SPEED_BASE_HZ electrical. Any context. */
static inline int32_t current_loop_w_q15(const volatile struct current_loop *c)
{
    return q15_sat16(c->pll.speed_q32 >> 13);
}

/* Electrical angle of the field, for display. Any context. */
static inline uint32_t current_loop_angle_u16(const volatile struct current_loop *c)
{
    return (c->pll.angle_q32 + c->angle_offset_q32) >> 16;
}

/* The state before the first use. Thread, once. */
void current_loop_init(struct current_loop *c);

/* Takes what does not depend on the bus: the encoder's scale. Slow loop or thread, bridge off. */
void current_loop_tune(volatile struct current_loop *c, const struct tuning *t);

/* From now on the controllers work and the thresholds count, or neither does. Slow loop. */
void current_loop_on(volatile struct current_loop *c, struct fabric *f, const struct tuning *t);
void current_loop_off(volatile struct current_loop *c, struct fabric *f);

/* Lets the field stand at an angle, whatever the rotor does, until the next call. Slow loop, every millisecond. */
void current_loop_force_angle(volatile struct current_loop *c, uint32_t angle_q32);

/* Gains and feed-forward for the present bus voltage, speed and references. Slow loop, every millisecond, last. */
void current_loop_follow(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t);

#endif
