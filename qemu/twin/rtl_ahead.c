/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RTL decides; what is said here of when it will is only a promise, which the twin's own model of the PWM gives, filled in
 * from the RTL's registers. */
#include "rtl_parts.h"

#define CHOPPER_OLD 65537 /* clocks from the results on */

static void fill_promise(struct fabric_rtl *r)
{
    struct rtl_pwm look;
    struct pwm *p = &r->promise;
    r->calls->look(r->axis, &look, &r->beside);
    r->trip_at = r->beside.trip_in == 0 ? INT64_MAX : r->clock + r->beside.trip_in;
    r->watch_at = r->beside.watch_in == 0 ? INT64_MAX : r->clock + r->beside.watch_in;
    r->sto_at = r->beside.sto_in == 0 ? INT64_MAX : r->clock + r->beside.sto_in;
    *p = (struct pwm){.control = look.control,
                      .period = look.period,
                      .dead = look.dead,
                      .min_pulse = look.min_pulse,
                      .mode = look.mode,
                      .phase = look.phase,
                      .trigger = {look.trigger[0], look.trigger[1]},
                      .fresh = look.fresh,
                      .running = look.running,
                      .rising = look.rising,
                      .count = look.count,
                      .live = r->out.live,
                      .clock = r->clock,
                      .rested_at = r->clock - 1};
    for (int k = 0; k < 3; k++) {
        p->compare[k] = (struct pwm_compare){look.newest[k], look.compare[k], look.waiting[k], false};
        p->leg[k] = (struct pwm_leg){look.side[k], look.on[k], look.left[k], look.on[k]};
    }
    pwm_plan(p);
    r->promised = true;
    if (p->running && p->count == p->period && !p->rising) {
        r->fabric.valley_at = rtl_time_of(r->clock);
    }
}

const struct pwm *rtl_promise(struct fabric_rtl *r)
{
    if (!r->promised) {
        fill_promise(r);
    }
    return &r->promise;
}

/* What is decided beside the PWM: an overrun in the clock that ends a conversion, its results behind it, the chopper behind
 * these or when they are old, a new value of the modulators' fast path, a proof of the program that is late, safe torque off,
 * and what stops, behind its flip-flops. */
static int64_t next_beside_pwm(const struct fabric_rtl *r)
{
    int64_t next = rtl_lesser(rtl_lesser(r->chopper_due, r->sto_at), rtl_lesser(r->trip_at, r->watch_at));
    if (r->finish != INT64_MAX) {
        next = rtl_lesser(next, r->finish > r->clock ? r->finish : r->finish + 1);
    }
    if (r->fabric.chops) {
        next = rtl_lesser(next, r->sampled_at + CHOPPER_OLD);
    }
    return r->clock < r->stops_until ? r->clock + 1 : next;
}

int64_t rtl_next_clock(struct fabric_rtl *r)
{
    if (r->count) {
        return r->event[r->first].clock;
    }
    int64_t in_pwm = rtl_promise(r)->next_clock, next = rtl_lesser(in_pwm, next_beside_pwm(r));
    return next > r->clock ? next : r->clock + 1;
}

void rtl_expect_results(struct fabric_rtl *r)
{
    struct rtl_pwm unused;
    r->calls->look(r->axis, &unused, &r->beside);
    if (r->beside.results_in != 0) {
        r->finish = r->clock + r->beside.results_in - 1;
    }
}
