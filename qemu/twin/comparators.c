/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "comparators.h"

#include <math.h>
#include <string.h>

#include "inverter.h"

void comparators_init(struct comparators *c)
{
    memset(c, 0, sizeof *c);
    for (int n = 0; n < COMPARATORS; n++) {
        c->since[n] = SIM_NEVER;
    }
    c->rise_at = SIM_NEVER;
    c->fall_at = SIM_NEVER;
}

bool comparators_beyond(const struct inverter *inv, int which)
{
    return inv->comparators.since[which] != SIM_NEVER;
}

void comparators_turn_on(struct inverter *inv, int leg, sim_ps now)
{
    const int blanked[2] = {leg, COMPARATOR_BUS};
    for (int n = 0; n < 2; n++) {
        if (comparators_beyond(inv, blanked[n])) {
            inv->comparators.since[blanked[n]] = now;
        }
    }
}

static sim_ps earlier(sim_ps a, sim_ps b)
{
    return a < b ? a : b;
}

/* When the first of those that are beyond the level has been so for long enough. */
static sim_ps blanked_until(const struct inverter *inv)
{
    sim_ps first = SIM_NEVER, blanking = sim_from_s(inv->p.oc_blanking_s);
    for (int n = 0; n < COMPARATORS; n++) {
        if (comparators_beyond(inv, n)) {
            first = earlier(first, inv->comparators.since[n] + blanking);
        }
    }
    return first;
}

sim_ps comparators_next(const struct inverter *inv)
{
    const struct comparators *c = &inv->comparators;
    sim_ps output = earlier(c->rise_at, c->fall_at);
    return c->tripped || !c->any ? output : earlier(output, blanked_until(inv));
}

/* The output follows after the delay. A second trip within the delay of a release keeps the output where it is. */
static void follow_output(struct inverter *inv, sim_ps now)
{
    struct comparators *c = &inv->comparators;
    sim_ps due = now + sim_from_s(inv->p.oc_delay_s);
    if (c->tripped) {
        c->fall_at = SIM_NEVER;
        c->rise_at = inv->overcurrent ? SIM_NEVER : earlier(c->rise_at, due);
    } else if (inv->overcurrent || c->rise_at != SIM_NEVER) {
        c->fall_at = earlier(c->fall_at, due);
    }
    if (c->rise_at <= now) {
        inv->overcurrent = true;
        c->rise_at = SIM_NEVER;
    }
    if (c->fall_at <= now) {
        inv->overcurrent = false;
        c->fall_at = SIM_NEVER;
    }
}

bool comparators_idle(const struct inverter *inv, const double i_a[COMPARATORS])
{
    const struct comparators *c = &inv->comparators;
    double level_a = inv->p.oc_trip_a;
    bool beyond = fabs(i_a[0]) > level_a || fabs(i_a[1]) > level_a || fabs(i_a[2]) > level_a || fabs(i_a[3]) > level_a;
    return !beyond && !c->any && !inv->overcurrent && c->rise_at == SIM_NEVER && c->fall_at == SIM_NEVER;
}

void comparators_follow(struct inverter *inv, const double i_a[COMPARATORS], const sim_ps beyond_at[COMPARATORS],
                        sim_ps now)
{
    struct comparators *c = &inv->comparators;
    c->any = false;
    for (int n = 0; n < COMPARATORS; n++) {
        if (fabs(i_a[n]) <= inv->p.oc_trip_a) {
            c->since[n] = SIM_NEVER;
        } else {
            c->since[n] = earlier(c->since[n], beyond_at[n]);
            c->any = true;
        }
    }
    c->tripped = c->any && (c->tripped || blanked_until(inv) <= now);
    if (c->tripped || inv->overcurrent || c->rise_at != SIM_NEVER) {
        follow_output(inv, now);
    }
}
