/* SPDX-License-Identifier: MIT */
#include "firmware/axis/axis.h"
#include "firmware/axis/supervision.h"
#include "lib/q15.h"

#define STALL_MS      500u
#define STEP_MS       2u /* from turn to turn of what looks at the speed */
#define FAR_MS        4u
#define LOSING_MS     4u
#define LOOK_AHEAD_MS 10
#define RATE_SHIFT    1
#define LIMITED_MS    100u
#define CYCLE_LONGEST 100u /* ms of half a wave: six in 300 ms have 50 */
#define CYCLE_HALVES  6u
#define SOFTENED_Q8   179 /* 0.7 */
#define SOFTENED_MOST 5u  /* 0.17: an inertia that is told five times too large is forgiven */

/* What the encoder resolves within a millisecond: two counts. */
static int32_t resolved_rpm_q4(const struct axis *a)
{
    return 2 * 60 * 1000 * 16 / a->params.encoder_counts;
}

void supervise_speed_begin(struct axis *a)
{
    const int32_t share_q4 = (int32_t)((int64_t)a->params.speed_max_rpm * 16 * a->params.deviation_pct / 100);
    a->supervision.speed = (struct speed_watch){.deviation_q4 = q15_max(share_q4, resolved_rpm_q4(a))};
    a->supervision.cycle = (struct cycle_watch){.softened = 0};
}

static void watch_stall(struct axis *a, struct speed_watch *s)
{
    const bool stuck = a->speed.at_limit && q15_abs(a->speed.speed_rpm_q4) < AXIS_STANDSTILL_RPM_Q4;
    if (stuck) {
        s->stalled_ms += STEP_MS;
    } else { /* a count more or less of a shaft that gives does not begin it anew */
        s->stalled_ms -= s->stalled_ms != 0u ? STEP_MS : 0u;
    }
    if (s->stalled_ms >= STALL_MS) {
        axis_report(a, FAULT_STALL, 0, 0);
    }
}

/*
 * Two ways to have lost the speed: it is too far from the reference; or it will be in LOOK_AHEAD_MS, although the motor does
 * what it can: then the load is the stronger one.
 */
static void watch_deviation(struct axis *a, struct speed_watch *s)
{
    const int32_t error_q4 = a->speed.speed_ref_rpm_q4 - a->speed.speed_rpm_q4;
    const int32_t distance_q4 = q15_abs(error_q4);
    s->rate_q4 += (distance_q4 - s->distance_q4 - s->rate_q4) >> RATE_SHIFT;
    s->distance_q4 = distance_q4;
    const bool helpless = a->speed.at_limit && (error_q4 < 0) == (a->loop.i_q_ref_q15 < 0);
    const bool losing =
        helpless && s->rate_q4 > 0 && distance_q4 + LOOK_AHEAD_MS / (int32_t)STEP_MS * s->rate_q4 > s->deviation_q4;
    s->losing_ms = losing ? s->losing_ms + STEP_MS : 0u;
    s->far_ms = distance_q4 > s->deviation_q4 ? s->far_ms + STEP_MS : 0u;
    int32_t phase;
    if ((s->far_ms < FAR_MS && s->losing_ms < LOSING_MS) || supervise_encoder_may_be_dead(a)) {
        return;
    }
    if (supervise_phases_suspect(a, &phase)) {
        axis_report(a, FAULT_OPEN_PHASE, phase, 0);
    } else {
        axis_report(a, FAULT_SPEED_DEVIATION, error_q4 / 16, 0);
    }
}

/* The modulator gives all it can, and a tenth of i_max is missing or too much. */
void supervise_voltage(struct axis *a)
{
    struct speed_watch *const s = &a->supervision.speed;
    const struct current_loop *const c = &a->loop;
    const int32_t missing_q15 = q15_abs(c->i_q_ref_q15 - c->i_q_q15) + q15_abs(c->i_d_ref_q15 - c->i_d_q15);
    const int32_t radius_q15 = c->radius_q15 - (c->radius_q15 >> 5);
    const bool limited = missing_q15 > a->tuning.i_max_q15 / 10 &&
                         c->v_d_q15 * c->v_d_q15 + c->v_q_q15 * c->v_q_q15 > radius_q15 * radius_q15;
    if (limited) {
        s->limited_ms += SUPERVISION_TURNS;
    } else {
        s->limited_ms -= s->limited_ms != 0u ? SUPERVISION_TURNS : 0u;
    }
    if (s->limited_ms >= LIMITED_MS) {
        axis_report(a, FAULT_VOLTAGE_LIMIT, 0, 0);
        s->limited_ms = 0;
    }
}

/* By a third, and what two looks at each end may be off. */
static bool alike(uint32_t a, uint32_t b)
{
    const uint32_t longer = a > b ? a : b;
    const uint32_t shorter = a > b ? b : a;
    return shorter * 3u + 3u >= longer * 2u;
}

/* The likely cause is an inertia that is told too large: all that is in proportion to it. */
static void soften(struct axis *a)
{
    a->tuning.speed_accel_q8 = (int32_t)(((int64_t)a->tuning.speed_accel_q8 * SOFTENED_Q8) >> 8);
    a->tuning.speed_kp_q16 = (int32_t)(((int64_t)a->tuning.speed_kp_q16 * SOFTENED_Q8) >> 8);
    a->tuning.speed_ki_q16 = (int32_t)(((int64_t)a->tuning.speed_ki_q16 * SOFTENED_Q8) >> 8);
}

static void end_half_wave(struct axis *a, struct cycle_watch *w)
{
    const int32_t high_q15 = q15_max(w->high_q15, w->last_high_q15);
    const int32_t low_q15 = q15_min(w->low_q15, w->last_low_q15);
    const bool swings = high_q15 - low_q15 > a->tuning.i_max_q15 / 2;
    const bool counts = swings && w->half_ms <= CYCLE_LONGEST && alike(w->half_ms, w->last_half_ms);
    w->halves = counts ? w->halves + 1u : 0u;
    w->last_half_ms = w->half_ms;
    w->last_high_q15 = w->high_q15;
    w->last_low_q15 = w->low_q15;
    w->half_ms = 0;
    w->high_q15 = a->loop.i_q_ref_q15;
    w->low_q15 = a->loop.i_q_ref_q15;
}

/* Homing looks for itself what stops the shaft. */
static bool speed_controlled(const struct axis *a)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        return false;
    }
    const uint32_t mode = a->mode;
    return mode == AXIS_MODE_SPEED || (!axis_mode_is_torque(mode) && mode != AXIS_MODE_HOMING);
}

/* The gains are reduced, a few times; if that does not help, it is a fault. */
static void end_cycle(struct axis *a, struct cycle_watch *w)
{
    w->halves = 0;
    if (w->softened == SOFTENED_MOST) {
        axis_report(a, FAULT_LIMIT_CYCLE, (int32_t)(1000u / (2u * w->last_half_ms)), 0);
    } else {
        w->softened++;
        soften(a);
        axis_warn(a, FAULT_LIMIT_CYCLE);
    }
}

static void watch_cycle(struct axis *a, struct cycle_watch *w)
{
    const bool below = a->speed.speed_rpm_q4 < a->speed.speed_ref_rpm_q4;
    const int32_t i_q_q15 = a->loop.i_q_ref_q15;
    w->half_ms += STEP_MS;
    w->high_q15 = q15_max(w->high_q15, i_q_q15);
    w->low_q15 = q15_min(w->low_q15, i_q_q15);
    if (below == w->error_below) {
        return;
    }
    w->error_below = below;
    end_half_wave(a, w);
    if (w->halves >= CYCLE_HALVES) {
        end_cycle(a, w);
    }
}

void supervise_speed(struct axis *a)
{
    if (speed_controlled(a)) {
        watch_cycle(a, &a->supervision.cycle);
        watch_deviation(a, &a->supervision.speed);
        watch_stall(a, &a->supervision.speed);
    }
}
