/* SPDX-License-Identifier: MIT */
/*
 * Compares the speed with its reference (supervision.h), inlined into its caller. What is seldom needed is in
 * supervision_speed.c. Slow loop, every second millisecond.
 */
#ifndef FIRMWARE_AXIS_SUPERVISION_SPEED_STEP_H
#define FIRMWARE_AXIS_SUPERVISION_SPEED_STEP_H

#include "firmware/axis/axis.h"
#include "firmware/axis/supervision.h"
#include "lib/q15.h"
#include "lib/usually.h"

#define SPEED_WATCH_STEP_MS       2u /* from look to look */
#define SPEED_WATCH_STALL_MS      500u
#define SPEED_WATCH_FAR_MS        4u
#define SPEED_WATCH_LOSING_MS     4u
#define SPEED_WATCH_LOOK_AHEAD_MS 10
#define SPEED_WATCH_RATE_SHIFT    1

/* Seldom: the speed has crossed its reference; it is lost. */
void supervise_half_wave(struct axis *a);
void supervise_lost_speed(struct axis *a);

static inline void speed_watch_cycle(struct axis *a, struct cycle_watch *w)
{
    const bool below = a->speed.speed_rpm_q4 < a->speed.speed_ref_rpm_q4;
    const int32_t i_q_q15 = a->loop.i_q_ref_q15;
    w->half_ms += SPEED_WATCH_STEP_MS;
    w->high_q15 = q15_max(w->high_q15, i_q_q15);
    w->low_q15 = q15_min(w->low_q15, i_q_q15);
    if (SELDOM(below != w->error_below)) {
        w->error_below = below;
        supervise_half_wave(a);
    }
}

/*
 * Two ways to lose the speed: it is too far from the reference; or it will be in SPEED_WATCH_LOOK_AHEAD_MS although the motor
 * does all it can: then the load is stronger.
 */
static inline void speed_watch_deviation(struct axis *a, struct speed_watch *s)
{
    const int32_t error_q4 = a->speed.speed_ref_rpm_q4 - a->speed.speed_rpm_q4;
    const int32_t distance_q4 = q15_abs(error_q4);
    const int32_t rate_q4 = s->rate_q4 + ((distance_q4 - s->distance_q4 - s->rate_q4) >> SPEED_WATCH_RATE_SHIFT);
    const bool helpless = a->speed.at_limit && (error_q4 < 0) == (a->loop.i_q_ref_q15 < 0);
    const bool losing =
        helpless && rate_q4 > 0 &&
        distance_q4 + SPEED_WATCH_LOOK_AHEAD_MS / (int32_t)SPEED_WATCH_STEP_MS * rate_q4 > s->deviation_q4;
    const uint32_t losing_ms = losing ? s->losing_ms + SPEED_WATCH_STEP_MS : 0u;
    const uint32_t far_ms = distance_q4 > s->deviation_q4 ? s->far_ms + SPEED_WATCH_STEP_MS : 0u;
    s->rate_q4 = rate_q4;
    s->distance_q4 = distance_q4;
    s->losing_ms = losing_ms;
    s->far_ms = far_ms;
    if (SELDOM(far_ms >= SPEED_WATCH_FAR_MS || losing_ms >= SPEED_WATCH_LOSING_MS)) {
        supervise_lost_speed(a);
    }
}

/* One count either way, of a shaft that yields, does not restart it. */
static inline void speed_watch_stall(struct axis *a, struct speed_watch *s)
{
    const bool stuck = SELDOM(a->speed.at_limit) && q15_abs(a->speed.speed_rpm_q4) < AXIS_STANDSTILL_RPM_Q4;
    if (USUALLY(!stuck && s->stalled_ms == 0u)) {
        return;
    }
    s->stalled_ms += stuck ? SPEED_WATCH_STEP_MS : -SPEED_WATCH_STEP_MS;
    if (s->stalled_ms >= SPEED_WATCH_STALL_MS) {
        axis_report(a, FAULT_STALL, 0, 0);
    }
}

/* Homing checks for itself what stops the shaft. */
static inline bool speed_watch_applies(uint32_t state, uint32_t mode)
{
    return state == AXIS_OPERATION_ENABLED &&
           (USUALLY(mode == AXIS_MODE_SPEED) || (!axis_mode_is_torque(mode) && mode != AXIS_MODE_HOMING));
}

/* `state`: the present one. */
static inline __attribute__((always_inline)) void supervise_speed_here(struct axis *a, uint32_t state)
{
    if (speed_watch_applies(state, a->mode)) {
        speed_watch_cycle(a, &a->supervision.cycle);
        speed_watch_deviation(a, &a->supervision.speed);
        speed_watch_stall(a, &a->supervision.speed);
    }
}

#endif
