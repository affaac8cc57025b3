/* SPDX-License-Identifier: MIT */
#include "firmware/axis/axis.h"
#include "firmware/axis/rotor.h"
#include "firmware/axis/supervision.h"
#include "firmware/axis/supervision_speed_step.h"
#include "lib/q15.h"

#define LIMITED_MS    100u
#define CYCLE_LONGEST 100u /* ms per half wave: six in 300 ms have 50 */
#define CYCLE_HALVES  6u
#define SOFTENED_Q8   179 /* 0.7 */
#define SOFTENED_MOST 5u  /* 0.17: tolerates an inertia parameter five times too large */

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

void supervise_short_voltage(struct axis *a)
{
    struct speed_watch *const s = &a->supervision.speed;
    s->limited_ms += SUPERVISION_TURNS;
    if (s->limited_ms >= LIMITED_MS) {
        axis_report(a, FAULT_VOLTAGE_LIMIT, 0, 0);
        s->limited_ms = 0;
    }
}

/* Within a third, plus the error of two looks at each end. */
static bool alike(uint32_t a, uint32_t b)
{
    const uint32_t longer = a > b ? a : b;
    const uint32_t shorter = a > b ? b : a;
    return shorter * 3u + 3u >= longer * 2u;
}

static int32_t softened(int32_t gain)
{
    return q15_max((int32_t)(((int64_t)gain * SOFTENED_Q8) >> 8), 1);
}

/*
 * The likely cause is an inertia parameter that is too large: reduces every gain in proportion to it. The memory's gain twice:
 * the loop as a whole becomes slower but keeps its damping.
 */
static void soften(struct axis *a)
{
    a->tuning.speed_accel_q8 = softened(a->tuning.speed_accel_q8);
    a->tuning.speed_kp_q16 = softened(a->tuning.speed_kp_q16);
    a->tuning.speed_ki_q16 = softened(softened(a->tuning.speed_ki_q16));
    speed_loop_soften(&a->speed, softened(a->speed.kp_q16), softened(softened(a->speed.ki_q16)));
}

static void close_half_wave(struct axis *a, struct cycle_watch *w)
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

void supervise_half_wave(struct axis *a)
{
    struct cycle_watch *const w = &a->supervision.cycle;
    close_half_wave(a, w);
    if (w->halves >= CYCLE_HALVES) {
        end_cycle(a, w);
    }
}

/*
 * Finds the cause: a few milliseconds later a dead encoder or Hall switch, or an observer that has lost the rotor, is known,
 * and a phase without current shows.
 */
void supervise_lost_speed(struct axis *a)
{
    int32_t phase;
    if (rotor_has_hall(a) && hall_edge_is_overdue(&a->hall.speed)) {
        return;
    }
    if (sensorless_doubts(a) || supervise_encoder_may_be_dead(a)) {
        return;
    }
    if (supervise_phases_suspect(a, &phase)) {
        axis_report(a, FAULT_OPEN_PHASE, phase, 0);
    } else {
        axis_report(a, FAULT_SPEED_DEVIATION, (a->speed.speed_ref_rpm_q4 - a->speed.speed_rpm_q4) / 16, 0);
    }
}

void supervise_speed(struct axis *a)
{
    supervise_speed_here(a, a->state);
}
