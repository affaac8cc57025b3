/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One step of the bridge, and the books that are kept of it: what the supply gives, and where the energy goes. */
#ifndef TWIN_ACCOUNT_H
#define TWIN_ACCOUNT_H

#include "circuit.h"

/* The events to be located in a step: diodes whose current may end, and currents that reach the comparators' level. */
struct watch {
    bool diode[3];
    bool level[3];
};

struct step {
    struct inverter *inv;
    struct motor *motor; /* at the end, once it is tried */
    struct motor_state start;
    struct bridge_load load; /* at the start */
    struct bus_view bus;
    struct watch watch;
    double i_start_a[3];
    double margin_start_a;
    double start_in_j; /* energy into the motor until then */
    struct circuit circuit;
    double i_a[3];   /* leg currents at the end */
    double margin_a; /* at the end */
};

/* What the legs draw from the bus with these currents. */
struct bridge_load step_load(const struct inverter *inv, const double i_a[3]);
double step_bus_a(const struct bridge_load *load, double bus_v);

/* Brings supply and energies to the end of the step, in which the nodes have taken stored_j; returns the load there. */
struct bridge_load account_step(struct step *st, double stored_j, double dt_s);

#endif
