/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What stands between a leg's current and the converter: a first-order low pass, solved exactly while its input is linear
 * in time, and what the leg's own edges do to it.
 *
 *   lag dy/dt = u - y,  lag = 1 / (2 pi amp_hz)
 *   ringing   = ring_lsb exp(-t / ring_tau) cos(2 pi ring_hz t),  t since the leg's terminal last swung
 *
 * A terminal swings when it comes to the other rail, whether a switch or a diode takes it there. */
#ifndef TWIN_AMPLIFIER_H
#define TWIN_AMPLIFIER_H

#include "sensor_keys.h"

#define LONG_AGO_S 1.0 /* an edge of which nothing can be left */

/* What an amplifier is given over a stretch in which the legs do not change: a current that is linear in time. */
struct leg_view {
    double from_a, to_a;
    int level; /* where the terminal is: 1 at the upper rail, -1 at the lower, 0 between or at both */
};

struct amplifier {
    double out_a;
    double since_edge_s;
    int level; /* the rail where the terminal last was, 0 in the beginning */
};

void amplifier_init(struct amplifier *a);
/* left: the share of a deviation that dt_s leaves, exp(-dt / lag), which all amplifiers have in common. */
void amplifier_follow(struct amplifier *a, const struct leg_view *leg, double dt_s, double lag_s, double left);
double amplifier_ringing_lsb(const struct amplifier *a, const struct sensor_params *p);

#endif
