/* SPDX-License-Identifier: MIT */
#include "firmware/source/sensorless.h"

#include "firmware/axis/axis.h"
#include "firmware/settings/config.h"
#include "firmware/source/rotor.h"
#include "lib/angle.h"
#include "lib/limit.h"
#include "lib/pi.h"
#include "lib/polar.h"
#include "lib/q15.h"

/* ==== injection or observer ==== */

#define OBSERVER_MS 20u /* the observer must be valid for this long before it takes over */

/*
 * It takes over when its tracking loop, whose pole scales with speed, has five sixths of the injection's bandwidth: a slower
 * one loses the rotor when a load step stops it. Back at two thirds.
 */
#define TAKES_SIXTHS  5
#define LEAVES_SIXTHS 4

/* Or when the injected voltage no longer fits into the circle at this speed and q current. */
#define ROOM_MIN_Q8  240
#define ROOM_BACK_Q8 288

static bool observer_is_quick(const struct axis *a, int32_t sixths)
{
    const int32_t w = q15_abs(a->loop.pll.speed_q32) >> 14; /* as the gain of a tracking loop with this pole */
    return ((w * observer_quickest_q8(&a->tuning)) >> 8) * 6 >= a->loop.inject.track * sixths;
}

void injection_after_control(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    const bool asked = observer_is_quick(a, TAKES_SIXTHS) || injection_room_q8(&a->loop, &a->tuning) < ROOM_MIN_Q8;
    s->steady_ms = asked && a->loop.flux.margin_q8 >= OBSERVER_LEADS_Q8 ? s->steady_ms + 1u : 0u;
    if (s->steady_ms >= OBSERVER_MS) {
        observer_preset(&a->loop, &a->tuning);
        current_loop_exchange(&a->loop, LOOP_OBSERVER);
        s->weak_ms = 0;
    }
}

bool injection_should_lead(const struct axis *a)
{
    return a->loop.inject.track != 0 && !observer_is_quick(a, LEAVES_SIXTHS) &&
           injection_room_q8(&a->loop, &a->tuning) > ROOM_BACK_Q8;
}

bool injection_takes_over(struct axis *a)
{
    if (a->loop.inject.track == 0) {
        return false;
    }
    injection_resume(&a->loop);
    current_loop_exchange(&a->loop, LOOP_INJECTION);
    (void)injection_take(&a->loop);
    a->sensorless.steady_ms = 0;
    return true;
}

/* Gains, after current_loop_follow(). Slow loop, in injection. */
static void injection_lead_follow(struct axis *a)
{
    observer_follow(&a->loop, &a->tuning, OBSERVER_RESTS);
    injection_follow(&a->loop, &a->tuning);
}

#define QUARTER_Q32    0x40000000u
#define HOLD_SHIFT     6 /* the held voltage moves by 1/64 of the difference per millisecond */
#define MARGIN(tenths) (256 * (tenths) / 10)
#define SEES_MARGIN    MARGIN(15) /* the observer is released */
#define LEADS_ALL \
    MARGIN(20) /* and may take over: OBSERVER_LEADS_Q8 with the torque current alone, this much with the field's */
#define WEAK_MARGIN MARGIN(30) /* and must hand back */
#define DOUBTFUL_MARGIN \
    MARGIN(60) /* nor if its flux is off by DOUBT_RHO_Q15: at 0.3 it counts as lost (monitor/lock_watch.c) */
#define DOUBT_RHO_Q15     8847
#define STEADY_MS         20u
#define WEAK_MS           8u
#define STEADY_RHO_Q15    8192       /* a quarter */
#define STEADY_LAG_Q32    (1u << 28) /* 22 degrees from its mean over 16 ms: it oscillates but is not lost */
#define LAG_MAX_Q32       ((1u << 30) - (1u << 26)) /* nearly 90 degrees */
#define LAG_SHIFT         4
#define HOLD_BACK_MAX_Q32 (1 << 29) /* 45 degrees */
#define SLEW_SHIFT        4         /* slew of the field's currents: 1/16 of i_max a millisecond */

enum align_step {
    ALIGN_ACROSS, /* 90 degrees from the rotor's final position, because there is no torque at 180 degrees */
    ALIGN_NEARER, /* half of that: friction of two thirds of the torque holds a rotor at 130 degrees */
    ALIGN_ALONG,
    ALIGN_LESS, /* with less current, to measure the resistance; a load is still held */
};

static int32_t slew(int32_t from, int32_t to, int32_t most)
{
    return from + q15_clamp(to - from, -most, most);
}

static int32_t slew_of(const struct axis *a)
{
    return (a->tuning.i_max_q15 >> SLEW_SHIFT) + 1;
}

/* ---- start ---- */

void sensorless_begin(struct axis *a)
{
    a->sensorless = (struct sensorless){.step = ALIGN_ACROSS};
    current_loop_field(&a->loop, QUARTER_Q32, 0);
}

/* The voltage slowly follows the current error: constant on the scale of the rotor's oscillation, which it damps. */
static void hold_voltage(struct axis *a, int32_t i_q15)
{
    struct sensorless *const s = &a->sensorless;
    const int32_t missing_q15 = i_q15 - a->loop.i_d_q15;
    s->i_q23 += (a->loop.i_d_q15 * (1 << 8) - s->i_q23) >> HOLD_SHIFT;
    s->v_q23 = q15_clamp(s->v_q23 + ((a->tuning.r_q12 * missing_q15) >> (4 + HOLD_SHIFT)), 0, (Q15_ONE / 2) << 8);
    const int32_t v_steps = (s->v_q23 >> 8) * CONFIG_BUS_STEPS / q15_max(a->loop.vbus_q15, a->tuning.v_min_q15);
    current_loop_hold(&a->loop, q15_min(v_steps, LOOP_V_D_MAX_STEPS - 1) * (1 << PI_SHIFT), 0);
}

/*
 * The resistance at the winding's present temperature: from two currents, so dead time drops out. They differ by a quarter,
 * which may be ten ADC steps, so samples are averaged. Limited to what temperature and tolerance can make of the parameter.
 */
static void take_resistance(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    struct tuning *const t = &a->tuning;
    const int32_t by_q23 = q15_max(s->i_full_q23 - s->i_q23, 1 << 8);
    const int32_t measured_q12 = (int32_t)((int64_t)(s->v_full_q23 - s->v_q23) * 4096 / by_q23);
    const int32_t r_q12 = q15_clamp(measured_q12, t->r_q12 * 5 / 8, t->r_q12 * 7 / 4);
    t->observer.r_q5 = q15_min((int32_t)((int64_t)t->observer.r_q5 * r_q12 / q15_max(t->r_q12, 1)), INT16_MAX);
    t->r_q12 = q15_max(r_q12, 1);
}

static int32_t less_q15(int32_t i_q15)
{
    return i_q15 * 3 / 4;
}

/* The next part of the start; true after the last. */
static bool align_next(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    s->ms = 0;
    switch (s->step) {
    case ALIGN_ACROSS:
        current_loop_field(&a->loop, QUARTER_Q32 / 2u, 0);
        s->step = ALIGN_NEARER;
        return false;
    case ALIGN_NEARER:
        current_loop_field(&a->loop, 0, 0);
        s->step = ALIGN_ALONG;
        return false;
    case ALIGN_ALONG:
        s->i_full_q23 = s->i_q23;
        s->v_full_q23 = s->v_q23;
        s->step = ALIGN_LESS;
        return false;
    default:
        take_resistance(a);
        s->i_q15 = less_q15(a->tuning.field.i_align_q15);
        current_loop_set_i_d(&a->loop, s->i_q15);
        return true;
    }
}

bool sensorless_align(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    const int32_t i_q15 = a->tuning.field.i_align_q15;
    const int32_t now_q15 = s->step == ALIGN_LESS ? less_q15(i_q15) : i_q15;
    hold_voltage(a, now_q15);
    current_loop_set_i_d(&a->loop, now_q15); /* not regulated: what the phases should carry, for the monitors */
    s->ms++;
    const uint32_t takes_ms = (uint32_t)a->tuning.field.align_ms >> (s->step == ALIGN_NEARER ? 1 : 0);
    return s->ms >= takes_ms && align_next(a);
}

/* ---- I-f: the field is prescribed ---- */

static int32_t lag_of(const struct axis *a)
{
    return (int32_t)(current_loop_angle_q32(&a->loop) - a->loop.pll.angle_q32);
}

/* Signed difference of two angles. */
static int32_t turned_by(int32_t angle_q32, int32_t from_q32)
{
    return (int32_t)((uint32_t)angle_q32 - (uint32_t)from_q32);
}

/* The rotor's torque at these currents, in torque.h's units. */
static int32_t torque_of(const struct tuning *t, int32_t i_d_q15, int32_t i_q_q15)
{
    const int32_t flux_q11 = (t->emf_q12 >> 1) - ((t->saliency_q11 * i_d_q15) >> 15);
    return (int32_t)((int64_t)i_q_q15 * flux_q11 / t->torque_emf_q11);
}

static bool is_steady(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    const volatile struct current_loop *const c = &a->loop;
    const int32_t lag_q32 = lag_of(a);
    const int32_t off_q32 = turned_by(lag_q32, s->lag_q32);
    s->lag_q32 += off_q32 >> LAG_SHIFT;
    s->grows_q32 = off_q32 >> LAG_SHIFT;
    return c->flux.margin_q8 >= LEADS_ALL && c->flux.margin_torque_q8 >= OBSERVER_LEADS_Q8 &&
           q15_abs(c->flux.rho_q15) < STEADY_RHO_Q15 && angle_size_q32(off_q32) < STEADY_LAG_Q32 &&
           angle_size_q32(lag_q32) < LAG_MAX_Q32;
}

/* The rotor's mean position relative to the field, over a period of its oscillation. */
static void follow_rest(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    const int32_t lag_q32 = lag_of(a);
    if (!s->observed) {
        s->rest_q32 = lag_q32;
        s->observed = true;
    }
    s->rest_q32 =
        (int32_t)((uint32_t)s->rest_q32 + (uint32_t)(turned_by(lag_q32, s->rest_q32) / a->tuning.field.rest_ms));
}

static void observer_takes_over(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const int32_t target_rpm_q16 = a->speed.target_rpm_q16;
    current_loop_follow_rotor(c);
    current_loop_correct(c, 0u, -(a->sensorless.grows_q32 / a->tuning.loops_per_slow));
    current_loop_restart_feedforward(c, a->fabric, &a->tuning);
    rotor_take_speed(a);
    const int32_t torque_q15 = torque_of(&a->tuning, c->i_d_ref_q15, c->i_q_ref_q15);
    speed_loop_reset(&a->speed, torque_q15);
    a->speed.target_rpm_q16 = target_rpm_q16;
    a->sensorless.ref_rpm_q16 = a->speed.ref_rpm_q16;
    a->sensorless.extra_q15 = c->i_d_ref_q15;
    a->sensorless.weak_ms = 0;
}

static void set_field_current(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    const int32_t limit_q15 = thermal_i_limit_q15(&a->thermal, a->tuning.field.i_q15);
    const int32_t most = slew_of(a);
    s->i_q15 = slew(s->i_q15, limit_q15, most);
    current_loop_set_currents(&a->loop, slew(a->loop.i_d_ref_q15, s->i_q15, most), slew(a->loop.i_q_ref_q15, 0, most));
}

/*
 * The rotor oscillates about the field, damped only by friction. This adds damping of 0.35 of critical: the field is held back
 * by as much as the rotor lags beyond its mean over about a period.
 */
static int32_t hold_back_q32(const struct axis *a)
{
    const struct sensorless *const s = &a->sensorless;
    const int32_t more_q32 = q15_clamp(turned_by(lag_of(a), s->rest_q32), -HOLD_BACK_MAX_Q32, HOLD_BACK_MAX_Q32);
    return s->observed ? more_q32 / a->tuning.field.yield_loops : 0;
}

/* The maximum ramp now. */
static int32_t field_ramp_q16(const struct axis *a)
{
    const struct tuning_field *const t = &a->tuning.field;
    const int32_t ref_q16 = a->speed.ref_rpm_q16;
    const bool speeds_up = ref_q16 == 0 || (ref_q16 < 0) == (a->speed.target_rpm_q16 < 0);
    return speeds_up && q15_abs(ref_q16) < t->creep_below_q16 ? q15_min(t->creep_q16, t->ramp_q16) : t->ramp_q16;
}

static void turn_field(struct axis *a, int32_t slope_q16)
{
    const int32_t rpm_q16 = speed_loop_lead(&a->speed, q15_min(slope_q16, field_ramp_q16(a)));
    const int32_t speed_q32 = (int32_t)(((int64_t)rpm_q16 * a->tuning.field.speed_per_rpm_q12) >> 12);
    current_loop_field_speed(&a->loop, speed_q32 - hold_back_q32(a));
    current_loop_run(&a->loop, speed_q32);
}

bool sensorless_lead_field(struct axis *a, int32_t slope_q16)
{
    struct sensorless *const s = &a->sensorless;
    if (rotor_is_known(a)) {
        return false;
    }
    turn_field(a, slope_q16);
    set_field_current(a);
    if (a->loop.flux.margin_q8 < SEES_MARGIN) {
        observer_reset(&a->loop, &a->tuning, current_loop_angle_q32(&a->loop), a->loop.i_d_q15);
        s->lag_q32 = 0;
        s->steady_ms = 0;
        s->observed = false;
        return true;
    }
    follow_rest(a);
    s->steady_ms = is_steady(a) ? s->steady_ms + 1u : 0u;
    if (s->steady_ms >= STEADY_MS) {
        observer_takes_over(a);
    }
    return true;
}

/* ---- the observer gives the angle ---- */

/*
 * The field's current, seen in the rotor's frame: its torque-producing part is present already, the rest ramps up along the
 * magnets.
 */
static void field_takes_over(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const int32_t i_q_q15 = c->i_q_ref_q15;
    const int32_t i_d_q15 = circle_rest_q15(i_q_q15, a->tuning.field.i_q15);
    a->sensorless.i_q15 = a->tuning.field.i_q15;
    a->sensorless.steady_ms = 0;
    a->sensorless.observed = false;
    current_loop_prescribe(c, atan2_q32(i_q_q15, i_d_q15), c->pll.speed_q32);
    current_loop_restart_feedforward(c, a->fabric, &a->tuning);
    a->speed.ref_rpm_q16 = scale_clamp(2LL * tuning_rpm_q15(&a->tuning, c->pll.speed_q32), -INT32_MAX, INT32_MAX);
}

/* Feeds the ramp's acceleration forward into the observer's speed. */
static void follow_ramp(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    const int64_t moved_q16 = (int64_t)a->speed.ref_rpm_q16 - s->ref_rpm_q16;
    s->ref_rpm_q16 = a->speed.ref_rpm_q16;
    if (a->mode == AXIS_MODE_SPEED && !a->speed.at_limit && moved_q16 != 0) {
        current_loop_accelerate(&a->loop, (int32_t)((moved_q16 * a->tuning.field.speed_per_rpm_q12) >> 12));
    }
}

/* At low EMF a wrong resistance shows in the flux amplitude before the margin is too small. */
static bool observer_is_weak(const volatile struct current_loop *c)
{
    return c->flux.margin_q8 < WEAK_MARGIN ||
           (c->flux.margin_q8 < DOUBTFUL_MARGIN && q15_abs(c->flux.rho_q15) > DOUBT_RHO_Q15);
}

void sensorless_after_control(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    volatile struct current_loop *const c = &a->loop;
    if (!rotor_is_known(a)) {
        return;
    }
    if (s->extra_q15 != 0) {
        s->extra_q15 = slew(s->extra_q15, 0, slew_of(a));
        const int32_t room_q15 = circle_rest_q15(c->i_q_ref_q15, a->tuning.i_max_q15);
        current_loop_set_i_d(c, q15_clamp(c->i_d_ref_q15 + s->extra_q15, -room_q15, room_q15));
    }
    follow_ramp(a);
    if (injection_leads(a)) {
        injection_after_control(a);
        return;
    }
    const bool weak = observer_is_weak(c) || (FEATURE_IN(INJECTION) && injection_should_lead(a));
    s->weak_ms = s->extra_q15 == 0 && weak ? s->weak_ms + 1u : 0u;
    if (s->weak_ms < WEAK_MS || (FEATURE_IN(INJECTION) && injection_takes_over(a))) {
        return;
    }
    if (a->tuning.reluctant) {
        fault_report(a, FAULT_LOCK_LOST, 0, c->flux.margin_q8 * 10 / 256); /* nor can the field take over */
    } else {
        field_takes_over(a);
    }
}

void sensorless_follow(struct axis *a)
{
    if (injection_leads(a)) {
        injection_lead_follow(a);
        return;
    }
    observer_follow(&a->loop, &a->tuning, rotor_is_known(a) ? OBSERVER_LEADS : OBSERVER_FOLLOWS);
}
