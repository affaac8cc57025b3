/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/lock_watch.h"

#include "firmware/axis/axis.h"
#include "firmware/monitor/emf_along.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

#define LOST_MS      10u
#define LOST_RHO_Q15 9830            /* 0.3 */
#define LOST_MARGIN  (256 * 15 / 10) /* observer.h */

void lock_watch_begin(struct lock_watch *w)
{
    *w = (struct lock_watch){.lost_ms = 0};
}

/* The EMF of the rotor's supposed speed is there: at least 0.7 of it, and 1.3 at most. */
static bool emf_contradicts(const struct axis *a)
{
    if (a->tuning.observer.lq_more != 0) {
        return false; /* saturated iron makes an EMF from q currents */
    }
    const int32_t w_q15 = current_loop_w_q15(&a->loop);
    const int32_t expected_q15 = emf_expected_q15(a, w_q15);
    return q15_abs(emf_along_q15(a, w_q15) - expected_q15) >
           expected_q15 * 3 / 10 + expected_q15 * 256 / q15_max(a->loop.flux.margin_q8, 1);
}

bool lock_watch_doubts(const struct axis *a)
{
    return rotor_is_sensorless(a) && a->lock_watch.lost_ms != 0u;
}

static void count(struct axis *a, bool lost, int32_t detail)
{
    struct lock_watch *const w = &a->lock_watch;
    w->lost_ms = lost ? w->lost_ms + 1u : 0u;
    if (w->lost_ms >= LOST_MS) {
        fault_report(a, FAULT_LOCK_LOST, detail, a->loop.flux.margin_q8 * 10 / 256);
    }
}

/*
 * The current response along the low-inductance axis exceeds the mean of both axes, and saturation increases it; so a response
 * below the mean belongs to another axis.
 */
static void watch_injection(struct axis *a)
{
    const int32_t mean = injection_take(&a->loop).d / a->tuning.loops_per_slow;
    const int32_t least = (a->injection.straight * a->loop.inject.share_q8) >> 8;
    count(a, mean < least, 100 - mean * 100 / q15_max(least, 1));
}

static void watch_observer(struct axis *a)
{
    const struct observer *const o = &a->loop.flux;
    const bool lost = q15_abs(o->rho_q15) > LOST_RHO_Q15 || o->margin_q8 < LOST_MARGIN || emf_contradicts(a);
    count(a, lost, o->rho_q15 * 100 / Q15_ONE);
}

static void watch_lead(struct axis *a)
{
    struct lock_watch *const w = &a->lock_watch;
    if (w->source != (uint32_t)a->loop.source) {
        w->source = (uint32_t)a->loop.source;
        w->lost_ms = 0;
    }
    field_watch_reset(&a->field_watch);
    if (injection_leads(a)) {
        watch_injection(a);
    } else {
        watch_observer(a);
    }
}

bool lock_watch_step(struct axis *a)
{
    const uint32_t reported = a->reports.count;
    if (rotor_has_hall(a)) {
        hall_watch_step(a);
    } else if (rotor_is_known(a)) {
        watch_lead(a);
    } else {
        a->lock_watch.lost_ms = 0;
        field_watch_step(a);
    }
    return a->reports.count == reported && a->failover.pending == FAULT_NONE;
}
