/* SPDX-License-Identifier: MIT */
/* The current loop's other half: what the slow loop prepares for the interrupt. */
#include "firmware/control/current_loop.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/fabric.h"
#include "firmware/settings/config.h"
#include "lib/advance.h"
#include "lib/limit.h"
#include "lib/pi.h"
#include "lib/trig.h"

/* A machine with wider pointers lays it out otherwise: unit tests run on one, and have no assembly. */
#if UINTPTR_MAX == UINT32_MAX
#define AT(offset, member) \
    _Static_assert(offsetof(struct current_loop, member) == (offset), #member " is not where the assembly has it")
AT(LOOP_ANGLE, pll.angle_q32);
AT(LOOP_SPEED, pll.speed_q32);
AT(LOOP_ANGLE_OFFSET, angle_offset_q32);
AT(LOOP_SINE, sine);
AT(LOOP_I_D_REF, i_d_ref_q15);
AT(LOOP_I_Q_REF, i_q_ref_q15);
AT(LOOP_KP_D, kp_d_q9);
AT(LOOP_KP_Q, kp_q_q9);
AT(LOOP_INTEGRAL_D, integral_d_q9);
AT(LOOP_INTEGRAL_Q, integral_q_q9);
AT(LOOP_TURN, turn_q15);
AT(LOOP_KI, ki_q15);
AT(LOOP_I_D, i_d_q15);
AT(LOOP_I_Q, i_q_q15);
AT(LOOP_V_D, v_d_q4);
AT(LOOP_V_Q, v_q_q4);
AT(LOOP_ENCODER, encoder_scale_q32);
AT(LOOP_STATUS_MAX, status_max);
AT(LOOP_CIRCLE, circle_q4);
#endif
_Static_assert(LOOP_PWM_COUNTS == CONFIG_PWM_COUNTS, "set LOOP_PWM_COUNTS in current_loop_layout.h as well");
_Static_assert(LOOP_DEAD_COUNTS == CONFIG_DEAD_COUNTS, "set LOOP_DEAD_COUNTS in current_loop_layout.h as well");
_Static_assert(LOOP_V_D_MAX_Q4 == 1 << 14, "SSAT #15 in the assembly");
_Static_assert(LOOP_DEAD_COUNTS < 256 && LOOP_PWM_COUNTS % 4 == 0, "the assembly's immediates");

/*
 * Radius of the circle, v_q4: a phase reaches Vbus/sqrt(3) with space vectors, and of each half of the period two dead times
 * are lost, because the edges of both sides and their dead times must fit into the period. Some counts are kept for rounding.
 */
#define RADIUS_COUNTS (CONFIG_PWM_COUNTS - 4u * CONFIG_DEAD_COUNTS - 8u)
#define RADIUS_Q4     ((int32_t)(RADIUS_COUNTS * 8u * 18919u / 32768u)) /* half of it, 16 to a count, over sqrt(3) */

/* What v_q4 can express: PWM periods of about 3900 to 7100 counts, 14 to 25 kHz at 100 MHz. */
_Static_assert(RADIUS_Q4 <= PI_OUTPUT_MAX, "PWM period too long for 16 steps a count: fewer, here and in the assembly");
_Static_assert(RADIUS_Q4 > LOOP_V_D_MAX_Q4,
               "PWM period too short: v_d alone could leave the circle; a smaller SSAT in the assembly");

/* Volts of the per-unit system become v_q4 by this over the bus voltage: v / vbus of half a period, 16 to a count. */
#define V_FULL_Q4 ((int32_t)CONFIG_PWM_COUNTS * 8)

/* 1.5 periods at a speed of 1.0 = 1/16 turn a period, in radians */
#define TURN_PER_W_Q15 19302

/*
 * The largest turn, at 770 Hz electrical; beyond it the voltages lag. Larger ones could turn a saturated voltage back inside
 * the circle, where the integral would not see that it is limited.
 */
#define TURN_MAX_Q15 11900

static void fill_circle(struct current_loop *c)
{
    for (int32_t n = 0; n < 512; n++) {
        const int32_t low = (n - LOOP_CIRCLE_ZERO) * (1 << LOOP_CIRCLE_SHIFT);
        const int32_t farthest = low < 0 ? -low : low + (1 << LOOP_CIRCLE_SHIFT) - 1;
        c->circle_q4[n] = (uint16_t)circle_rest_q15(farthest, RADIUS_Q4);
    }
}

void current_loop_init(struct current_loop *c)
{
    *c = (struct current_loop){.sine = trig_chords, .status_max = UINT32_MAX};
    fill_circle(c);
}

void current_loop_tune(volatile struct current_loop *c, const struct tuning *t)
{
    c->encoder_scale_q32 = t->encoder_scale_q32;
}

/* ---- once a millisecond ---- */

/* A voltage of the per-unit system in the loop's unit. */
static int32_t v_q4(int32_t v_q15, int32_t vbus_q15)
{
    return q15_clamp(v_q15, -Q15_ONE, Q15_ONE) * V_FULL_Q4 / vbus_q15;
}

static int32_t v_q15(int32_t v_q4, int32_t vbus_q15)
{
    return v_q4 * vbus_q15 / V_FULL_Q4;
}

/* What it shows to others. */
static void publish(volatile struct current_loop *c, const struct fabric *f)
{
    c->vbus_q15 = adc_vbus_q15(&f->adc);
    c->radius_q15 = v_q15(RADIUS_Q4, c->vbus_q15);
    c->v_d_q15 = v_q15(c->v_d_q4, c->vbus_q15);
    c->v_q_q15 = v_q15(c->v_q_q4, c->vbus_q15);
}

/* The gains hold for the bus as it is. kp + ki: see lib/pi.h. */
static void set_gains(volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15)
{
    const int32_t ki_q15 = q15_min(t->ki_q17 * (V_FULL_Q4 / 4) / vbus_q15, PI_KI_MAX_Q15);
    c->kp_d_q9 = q15_min(t->kp_d_q12 * (V_FULL_Q4 / 8) / vbus_q15 + (ki_q15 >> 6), PI_KP_MAX_Q9);
    c->kp_q_q9 = q15_min(t->kp_q_q12 * (V_FULL_Q4 / 8) / vbus_q15 + (ki_q15 >> 6), PI_KP_MAX_Q9);
    c->ki_q15 = ki_q15;
}

/* The feed-forward is part of the integral (lib/pi.h): what it has changed by is added there. */
static void feed_forward(volatile int32_t *integral_q9, volatile int32_t *present_q4, int32_t wanted_q4)
{
    cpu_add(integral_q9, (wanted_q4 - *present_q4) * 512);
    *present_q4 = wanted_q4;
}

/* The axes disturb each other and the magnets disturb q: v_d = ... - w Lq i_q, v_q = ... + w (Ld i_d + psi). */
static void decouple(volatile struct current_loop *c, const struct tuning *t, int32_t w_q15, int32_t vbus_q15)
{
    const int32_t d_q15 = -(((w_q15 * c->i_q_ref_q15) >> 15) * t->x_q_q11 >> 11);
    const int32_t q_q15 = (((w_q15 * c->i_d_ref_q15) >> 15) * t->x_d_q11 >> 11) + ((w_q15 * t->emf_q12) >> 12);
    feed_forward(&c->integral_d_q9, &c->feedforward_d_q4, v_q4(d_q15, vbus_q15));
    feed_forward(&c->integral_q_q9, &c->feedforward_q_q4, v_q4(q_q15, vbus_q15));
}

static void rest(volatile struct current_loop *c)
{
    c->kp_d_q9 = 0;
    c->kp_q_q9 = 0;
    c->ki_q15 = 0;
    c->integral_d_q9 = 0;
    c->integral_q_q9 = 0;
    c->feedforward_d_q4 = 0;
    c->feedforward_q_q4 = 0;
}

void current_loop_follow(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t)
{
    const int32_t w_q15 = current_loop_w_q15(c);
    publish(c, f);
    c->turn_q15 = q15_clamp((w_q15 * TURN_PER_W_Q15) >> 15, -TURN_MAX_Q15, TURN_MAX_Q15);
    if (c->status_max == UINT32_MAX) {
        rest(c);
        return;
    }
    const int32_t vbus_q15 = q15_max(c->vbus_q15, t->v_min_q15);
    set_gains(c, t, vbus_q15);
    decouple(c, t, w_q15, vbus_q15);
}

void current_loop_on(volatile struct current_loop *c, struct fabric *f, const struct tuning *t)
{
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    rest(c);
    adc_clear_overrun(&f->adc);
    adc_set_limits(&f->adc, t->i_trip_q15, t->i_sum_q15, t->v_min_q15, t->v_max_q15);
    (void)gate_enable(&f->gate);
    c->status_max = GATE_STATUS_LIVE;
    current_loop_follow(c, f, t);
}

void current_loop_off(volatile struct current_loop *c, struct fabric *f)
{
    c->status_max = UINT32_MAX;
    gate_disable(&f->gate);
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    rest(c);
}

/* Until the next call the field goes along with the rotor: so that it is right in the middle of the time. */
void current_loop_force_angle(volatile struct current_loop *c, uint32_t angle_q32)
{
    const uint32_t halfway_q32 = (uint32_t)c->pll.speed_q32 * (CONFIG_LOOPS_PER_SLOW / 2u);
    c->angle_offset_q32 = angle_q32 - c->pll.angle_q32 - halfway_q32;
}
