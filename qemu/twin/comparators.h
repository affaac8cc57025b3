/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Over-current comparators as a gate driver has them, one on each leg and one in the bus: a current must stay beyond the
 * level for the blanking time, counted from its crossing or from the last turn-on of a switch of that leg (for the bus:
 * of any); the gate block sees the output a delay later. */
#ifndef TWIN_COMPARATORS_H
#define TWIN_COMPARATORS_H

#include <stdbool.h>

#include "simtime.h"

#define COMPARATORS    4 /* three legs, then the bus */
#define COMPARATOR_BUS 3

struct inverter;

struct comparators {
    sim_ps since[COMPARATORS]; /* when blanking began; SIM_NEVER: not beyond the level */
    bool any;                  /* one of them is */
    bool tripped;              /* before the delay */
    sim_ps rise_at, fall_at;   /* of the output */
};

void comparators_init(struct comparators *c);
bool comparators_beyond(const struct inverter *inv, int which);
/* A switch of this leg turns on. */
void comparators_turn_on(struct inverter *inv, int leg, sim_ps now);
/* The next instant at which they change by themselves. */
sim_ps comparators_next(const struct inverter *inv);
/* With these currents nothing happens, nor is anything on its way. */
bool comparators_idle(const struct inverter *inv, const double i_a[COMPARATORS]);
/* A step ends at now; beyond_at is when a current that is beyond the level, and was not before, got there. */
void comparators_follow(struct inverter *inv, const double i_a[COMPARATORS], const sim_ps beyond_at[COMPARATORS],
                        sim_ps now);

#endif
