/* SPDX-License-Identifier: MIT */
/*
 * One sample of the current loop in C, in four stages: sense -> angle -> regulate -> modulate. Each angle source is its own
 * instance: it is constant at the call, so the compiler keeps one path without branches, in constant time. current_loop_isr.S
 * is the hand-written instance for the encoder; tests require identical results.
 *
 * The conversion is acknowledged after its last value is read and before GATE.STATUS is read: a handler that returned before
 * its interrupt line dropped would run twice for one sample, unnoticed. Fabric accesses stay in order, so once that read
 * returns, the line is low.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_STEP_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_STEP_H

#include <stdbool.h>

#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop.h"
#include "firmware/control/stage_angle.h"
#include "firmware/control/stage_flux.h"
#include "firmware/control/stage_hall.h"
#include "firmware/control/stage_inject.h"
#include "firmware/control/stage_modulate.h"
#include "firmware/control/stage_overmodulate.h"
#include "firmware/control/stage_regulate.h"
#include "firmware/control/stage_sense.h"
#include "firmware/control/stage_weaken.h"
#include "lib/trig.h"

/* The field's angle at the sample. */
static inline __attribute__((always_inline)) uint32_t current_loop_angle(struct current_loop *c,
                                                                         enum loop_source source)
{
    switch (source) {
    case LOOP_ENCODER:
        return angle_of_rotor(c);
    case LOOP_OBSERVER:
    case LOOP_INJECTION:
    case LOOP_HALL:
        return angle_observed(c);
    default:
        return angle_of_field(c);
    }
}

/* Returns whether the sample has a fault. ISR; tests may call it with their own blocks. */
static inline __attribute__((always_inline)) bool current_loop_step(struct current_loop *c, struct fabric *f,
                                                                    enum loop_source source)
{
    const alphabeta_t i = sense(f);
    /* Here rather than at its use: the compiler still has registers for it. */
    const alphabeta_t coarse = {i.alpha >> c->dead_shift, i.beta >> c->dead_shift};
    const cossin_t cs = cossin_q15(current_loop_angle(c, source));
    const int32_t inject_steps = source == LOOP_INJECTION ? inject_voltage(&c->inject) : 0;
    const alphabeta_t calm = source == LOOP_INJECTION ? inject_calm(&c->inject, i) : i;
    const dq_t v = regulate(c, park_q15(calm, cs), inject_steps);
    const alphabeta_t v_steps = modulate(&f->pwm, v, cs, coarse, c->turn_q15);
    if (source == LOOP_OBSERVER || source == LOOP_INJECTION) {
        if (source == LOOP_OBSERVER) {
            flux_observe(c, i, v_steps);
        } else {
            inject_observe(c, i, cs);
        }
        f->adc.STATUS = ADC_STATUS_EOC;
        return (f->gate.STATUS & ~GATE_STATUS_ENCODER) > c->status_max; /* there may be none */
    }
    angle_observe(c, f->encoder.LATCHED);
    f->adc.STATUS = ADC_STATUS_EOC;
    return f->gate.STATUS > c->status_max;
}

/* The same from Hall switches. */
static inline __attribute__((always_inline)) bool current_loop_step_hall(struct current_loop *c, struct hall *h,
                                                                         struct fabric *f)
{
    const alphabeta_t i = sense(f);
    const alphabeta_t coarse = {i.alpha >> c->dead_shift, i.beta >> c->dead_shift};
    const cossin_t cs = cossin_q15(current_loop_angle(c, LOOP_HALL));
    modulate(&f->pwm, regulate(c, park_q15(i, cs), 0), cs, coarse, c->turn_q15);
    hall_observe(c, h, &f->encoder);
    f->adc.STATUS = ADC_STATUS_EOC;
    return (f->gate.STATUS & ~GATE_STATUS_ENCODER) > c->status_max; /* there may be none */
}

/*
 * The same for field weakening, from the encoder: v_d may take the whole circle, so limits apply in the frame in which the
 * voltages act, reached by an angle instead of two shears. `beyond`: beyond the modulator's circle.
 */
static inline __attribute__((always_inline)) bool current_loop_step_weakening(struct current_loop *c, struct fabric *f,
                                                                              bool beyond)
{
    const alphabeta_t i = sense(f);
    const alphabeta_t coarse = {i.alpha >> c->dead_shift, i.beta >> c->dead_shift};
    const uint32_t angle_q32 = angle_of_rotor(c);
    const dq_t v = regulate_weakening(c, park_q15(i, cossin_q15(angle_q32)));
    const cossin_t acting = cossin_q15(angle_q32 + c->weaken.turn_q32);
    if (beyond) {
        overmodulate(&f->pwm, v, acting, coarse, c->turn_q15);
    } else {
        modulate(&f->pwm, v, acting, coarse, c->turn_q15);
    }
    angle_observe(c, f->encoder.LATCHED);
    f->adc.STATUS = ADC_STATUS_EOC;
    return f->gate.STATUS > c->status_max;
}

#endif
