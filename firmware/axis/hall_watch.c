/* SPDX-License-Identifier: MIT */
#include "firmware/axis/hall_watch.h"

#include "firmware/axis/axis.h"

#define INVALID_SAMPLES 2u /* in a millisecond: at the largest speed a state lasts for more */

void hall_watch_begin(struct axis *a)
{
    const volatile struct hall *const h = &a->hall;
    a->hall_watch.invalid = h->invalid;
    a->hall_watch.skipped = h->skipped;
}

void hall_watch_step(struct axis *a)
{
    const struct hall_watch before = a->hall_watch;
    hall_watch_begin(a);
    if (a->hall_watch.invalid - before.invalid >= INVALID_SAMPLES) {
        axis_report(a, FAULT_HALL_INVALID, (int32_t)encoder_hall_latched(&a->fabric->encoder), 0);
    } else if (a->hall_watch.skipped != before.skipped) {
        axis_report(a, FAULT_HALL_SEQUENCE, (int32_t)encoder_hall_latched(&a->fabric->encoder), 0);
    }
}
