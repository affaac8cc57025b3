/* SPDX-License-Identifier: MIT */
#include "firmware/source/rotor.h"

/*
 * A double pole at a: a delay of 2 / a. The tracking gain is 2 a Ts / 2 pi times 2^17 (control/observer.c), so that is
 * 2^18 / (2 pi track) / pi samples.
 */
#define SETTLES_IN_SAMPLES 83443u

/*
 * The shaft's travel in the last millisecond, as a speed: the speed loop's memory counts it. With injection the angle itself
 * gives it. Instantaneous speeds would do on average, but unlike the angle's noise theirs does not cancel: a shaft that should
 * stand still under load would creep.
 */
static int32_t travel_q15(struct axis *a, int32_t speed_rpm_q15)
{
    const uint32_t angle_q32 = a->loop.pll.angle_q32;
    const int32_t moved_q32 = (int32_t)(angle_q32 - a->sensorless.angle_before_q32);
    a->sensorless.angle_before_q32 = angle_q32;
    return injection_leads(a) ? tuning_rpm_q15(&a->tuning, moved_q32 / a->tuning.loops_per_slow) : speed_rpm_q15;
}

/* The handler tracks the switches with the bridge off as well, from the first start on. */
static void take_hall_speed(struct axis *a)
{
    const struct hall_speed *const s = &a->hall.speed;
    if (a->loop.source != LOOP_HALL) {
        speed_loop_take(&a->speed, 0, 0, SPEED_ESTIMATE_CLOCKS_LOST);
        return;
    }
    hall_speed_step(&a->hall, &a->loop, &a->fabric->encoder, &a->tuning,
                    current_loop_is_on(&a->loop) ? a->torque.torque_q15 : 0);
    speed_loop_take(&a->speed, tuning_rpm_q15(&a->tuning, s->speed_q32), tuning_rpm_q15(&a->tuning, s->travel_q32),
                    hall_reported_clocks(s));
}

void rotor_count(struct axis *a)
{
    speed_loop_measure(&a->speed, &a->fabric->encoder, &a->tuning);
}

void rotor_take_speed(struct axis *a)
{
    if (rotor_has_hall(a) && a->failover.pending == FAULT_NONE) {
        take_hall_speed(a);
        return;
    }
    const uint32_t loop_counts = (uint32_t)a->tuning.loop_counts;
    const int32_t track = a->loop.flux.track;
    const uint32_t clocks = SETTLES_IN_SAMPLES * loop_counts / (uint32_t)(track < 1 ? OBSERVER_TRACK_MAX : track);
    if (!current_loop_is_on(&a->loop)) {
        speed_loop_take(&a->speed, 0, 0, clocks);
        return;
    }
    const int32_t speed_rpm_q15 = tuning_rpm_q15(&a->tuning, a->loop.pll.speed_q32);
    speed_loop_take(&a->speed, speed_rpm_q15, travel_q15(a, speed_rpm_q15), clocks);
}
