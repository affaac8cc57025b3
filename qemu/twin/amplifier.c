/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "amplifier.h"

#define TURN_RAD   6.283185307179586
#define SHORTEST_S 1e-15 /* what rounding leaves of a step: too short for a slope, and for an amplifier to answer */

void amplifier_init(struct amplifier *a)
{
    *a = (struct amplifier){.since_edge_s = LONG_AGO_S};
}

void amplifier_follow(struct amplifier *a, const struct leg_view *leg, double dt_s, double lag_s, double left)
{
    if (leg->level != 0 && leg->level != a->level) {
        a->since_edge_s = a->level == 0 ? a->since_edge_s : 0;
        a->level = leg->level;
    }
    if (dt_s < SHORTEST_S) {
        return;
    }
    a->since_edge_s += dt_s;
    double behind_a = (leg->to_a - leg->from_a) / dt_s * lag_s;
    a->out_a = leg->to_a - behind_a + (a->out_a - leg->from_a + behind_a) * left;
}

double amplifier_ringing_lsb(const struct amplifier *a, const struct sensor_params *p)
{
    if (p->ring_lsb == 0) {
        return 0;
    }
    return p->ring_lsb * exp(-a->since_edge_s / p->ring_tau_s) * cos(TURN_RAD * p->ring_hz * a->since_edge_s);
}
