/* SPDX-License-Identifier: MIT */
#include "firmware/axis/rotor.h"

/*
 * A double pole at a: 2 / a until it tells. The tracking gain is 2 a Ts / 2 pi times 2^17 (control/observer.c), so that is
 * 2^18 / (2 pi track) / pi samples.
 */
#define SETTLES_IN_SAMPLES 83443u

void rotor_take_speed(struct axis *a)
{
    const uint32_t loop_counts = (uint32_t)a->tuning.loop_counts;
    const int32_t track = a->loop.flux.track;
    const uint32_t clocks = SETTLES_IN_SAMPLES * loop_counts / (uint32_t)(track < 1 ? OBSERVER_TRACK_MOST : track);
    const bool on = current_loop_is_on(&a->loop);
    speed_loop_take(&a->speed, on ? tuning_rpm_q15(&a->tuning, a->loop.pll.speed_q32) : 0, clocks);
}
