/* SPDX-License-Identifier: MIT */
#include "firmware/source/injection_lead.h"

#include "firmware/axis/axis.h"
#include "lib/q15.h"

#define OBSERVER_MS 20u /* the observer must see the rotor for this long before it leads */

/*
 * And once its tracking loop, whose pole scales with the speed, is five sixths as fast as the injection's: a slow one slows
 * down further and loses the rotor when a load step stops it. Back when it is two thirds as fast.
 */
#define TAKES_SIXTHS  5
#define LEAVES_SIXTHS 4

/* Or once the wave no longer fits beside the voltage that the q current takes at this speed. */
#define ROOM_LEAST_Q8 240
#define ROOM_BACK_Q8  288

static bool observer_is_quick(const struct axis *a, int32_t sixths)
{
    const int32_t w = q15_abs(a->loop.pll.speed_q32) >> 14; /* as a gain of a tracking loop with its pole there */
    return ((w * observer_quickest_q8(&a->tuning)) >> 8) * 6 >= a->loop.inject.track * sixths;
}

void injection_after_control(struct axis *a)
{
    struct sensorless *const s = &a->sensorless;
    const bool asked = observer_is_quick(a, TAKES_SIXTHS) || injection_room_q8(&a->loop, &a->tuning) < ROOM_LEAST_Q8;
    s->calm_ms = asked && a->loop.flux.margin_q8 >= OBSERVER_LEADS_Q8 ? s->calm_ms + 1u : 0u;
    if (s->calm_ms >= OBSERVER_MS) {
        observer_preset(&a->loop, &a->tuning);
        current_loop_exchange(&a->loop, LOOP_OBSERVER);
        s->weak_ms = 0;
    }
}

bool injection_wants_back(const struct axis *a)
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
    a->sensorless.calm_ms = 0;
    return true;
}

void injection_lead_follow(struct axis *a)
{
    observer_follow(&a->loop, &a->tuning, OBSERVER_RESTS);
    injection_follow(&a->loop, &a->tuning);
}
