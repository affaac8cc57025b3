/* SPDX-License-Identifier: MIT */
/*
 * The slow loop's preparation for the interrupt each millisecond (current_loop_follow()), inlined into its caller. Rare cases
 * stay in current_loop.c.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_FOLLOW_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_FOLLOW_H

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/config.h"
#include "lib/pi.h"
#include "lib/q15.h"
#include "lib/usually.h"

/* Per-unit voltages become steps by CONFIG_BUS_STEPS over the bus voltage. */
_Static_assert(CONFIG_BUS_STEPS % 8 == 0, "the gains take an eighth of it");
_Static_assert(CONFIG_BUS_STEPS < 1 << 17, "a voltage of the whole bus, with 14 more bits, fits a word");

/* A radian in Q15 as a fraction of a turn, Q32: 2^17 / 2 pi. */
#define LOOP_TURN_Q32_PER_Q15 20861

/* Rare: significant current ripple, a changed bus voltage, saturating iron, bridge off. */
void current_loop_follow_ripple(volatile struct current_loop *c);
void current_loop_set_gains(volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15);
void current_loop_follow_iron(volatile struct current_loop *c, const struct tuning *t);
void current_loop_rest(volatile struct current_loop *c);

/*
 * A per-unit voltage in loop steps, by the reciprocal of the bus voltage: one division serves both axes, and its 17 bits
 * resolve a step. It is clamped to the bus voltage, CONFIG_BUS_STEPS, so the product stays below 2^31.
 */
static inline int32_t loop_steps_per_v_q14(int32_t vbus_q15)
{
    return (int32_t)(((uint32_t)CONFIG_BUS_STEPS << 14) / (uint32_t)vbus_q15);
}

static inline int32_t loop_v_steps(int32_t v_q15, int32_t vbus_q15, int32_t per_v_q14)
{
    return (q15_clamp(v_q15, -vbus_q15, vbus_q15) * per_v_q14) >> 14;
}

/* The inverse: one step's voltage. Steps up to six-step, 0.64 of the bus, times this stay below 2^31. */
static inline int32_t loop_v_per_step_q31(int32_t vbus_q15)
{
    return (int32_t)(((uint32_t)vbus_q15 * (0x80000000u / CONFIG_BUS_STEPS)) >> 15);
}

static inline int32_t loop_v_q15(int32_t v_steps, int32_t per_step_q31)
{
    return (v_steps * per_step_q31) >> 16;
}

/* Publishes values for status, trace and the monitors. */
static inline int32_t loop_publish(volatile struct current_loop *c, const struct fabric *f)
{
    const int32_t vbus_q15 = adc_vbus_q15(&f->adc);
    const int32_t per_step_q31 = loop_v_per_step_q31(vbus_q15);
    const int32_t v_d_steps = c->v_d_steps; /* all reads first: a read after a write waits for it */
    const int32_t v_q_steps = c->v_q_steps;
    const int32_t radius_steps = c->weaken.radius_steps;
    c->vbus_q15 = vbus_q15;
    c->radius_q15 = loop_v_q15(radius_steps, per_step_q31);
    c->v_d_q15 = loop_v_q15(v_d_steps, per_step_q31);
    c->v_q_q15 = loop_v_q15(v_q_steps, per_step_q31);
    if (SELDOM(pwm_fell_back(&f->pwm))) {
        c->fell_back++;
    }
    return vbus_q15;
}

/* The gains match the bus within 1/128: less is not worth three divisions. */
static inline bool loop_gains_hold(const volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15)
{
    const int32_t off_q15 = q15_abs(vbus_q15 - c->gains_vbus_q15);
    return off_q15 * 128 <= vbus_q15 && c->gains_of == t;
}

/* The feed-forward is part of the integral (lib/pi.h): its change is added there. */
static inline void loop_feed_forward(volatile int32_t *integral_q9, volatile int32_t *present_steps,
                                     int32_t wanted_steps)
{
    const int32_t change_steps = wanted_steps - *present_steps;
    if (change_steps != 0) {
        cpu_add(integral_q9, change_steps * (1 << PI_SHIFT));
        *present_steps = wanted_steps;
    }
}

/* The axes disturb each other and the magnets disturb q: v_d = ... - w Lq i_q, v_q = ... + w (Ld i_d + psi). */
static inline void loop_decouple(volatile struct current_loop *c, const struct tuning *t, int32_t w_q15,
                                 int32_t vbus_q15)
{
    const int32_t per_v_q14 = loop_steps_per_v_q14(vbus_q15);
    const int32_t d_q15 = -(((w_q15 * c->i_q_ref_q15) >> 15) * t->x_q_q11 >> 11);
    const int32_t q_q15 = (((w_q15 * c->i_d_ref_q15) >> 15) * t->x_d_q11 >> 11) + ((w_q15 * t->emf_q12) >> 12);
    loop_feed_forward(&c->integral_d_q9, &c->feedforward_d_steps, loop_v_steps(d_q15, vbus_q15, per_v_q14));
    loop_feed_forward(&c->integral_q_q9, &c->feedforward_q_steps, loop_v_steps(q_q15, vbus_q15, per_v_q14));
}

/* Whether the frame in which the currents are regulated is the rotor's, or a prescribed field's. */
static inline bool loop_follows_rotor(const volatile struct current_loop *c)
{
    return USUALLY(c->source == LOOP_ENCODER) || (current_loop_finds_rotor(c) && c->field_follows != 0u);
}

static inline int32_t loop_frame_w_q15(const volatile struct current_loop *c)
{
    return loop_follows_rotor(c) ? current_loop_w_q15(c) : q15_sat16(c->field_speed_q32 >> c->w_shift);
}

/* Field weakening needs the encoder. */
static inline bool current_loop_weakens(const volatile struct current_loop *c)
{
    return c->weaken.on && c->source == LOOP_ENCODER;
}

/* Returns the speed of the frame. */
static inline int32_t __attribute__((always_inline))
current_loop_follow_here(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t)
{
    const int32_t w_q15 = loop_frame_w_q15(c);
    const int32_t bus_q15 = loop_publish(c, f);
    if (SELDOM(c->ripple_q10 != 0)) {
        current_loop_follow_ripple(c);
    }
    const int32_t way_q15 = (w_q15 * c->turn_per_w_q15) >> 15;
    const int32_t turn_q15 = q15_clamp(way_q15, -LOOP_TURN_MAX_Q15, LOOP_TURN_MAX_Q15);
    c->turn_q15 = turn_q15;
    c->v_turn_q15 = turn_q15;
    if (SELDOM(current_loop_weakens(c))) {
        c->weaken.turn_q32 = (uint32_t)(way_q15 * LOOP_TURN_Q32_PER_Q15);
        c->v_turn_q15 = 0;
    }
    if (SELDOM(c->status_max == UINT32_MAX)) {
        current_loop_rest(c);
        return w_q15;
    }
    const int32_t vbus_q15 = q15_max(bus_q15, t->v_min_q15);
    if (SELDOM(!loop_gains_hold(c, t, vbus_q15))) {
        current_loop_set_gains(c, t, vbus_q15);
    }
    if (SELDOM(t->iron_grows_q10 != 0) && loop_follows_rotor(c)) {
        current_loop_follow_iron(c, t);
    }
    loop_decouple(c, t, w_q15, vbus_q15);
    return w_q15;
}

#endif
