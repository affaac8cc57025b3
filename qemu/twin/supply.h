/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What feeds the bridge:
 *
 *   source -- R2 beside C2 -- R -- L --+-----------+---------+---- bridge
 *   (dc or six pulses)                 C + ESR     chopper   |
 *
 * A loop inductance between capacitor and bridge has no place here: with ideal switches the bridge's current steps, and
 * a step would have to overcome it in no time. What it does in tens of nanoseconds cancels between the two edges of a
 * pulse but for L I per edge: 20 nH and 20 A at 20 kHz are 8 mV. */
#ifndef TWIN_SUPPLY_H
#define TWIN_SUPPLY_H

#include <stdbool.h>

struct inverter_params;

struct supply {
    double cap_v;
    double feed_a;    /* through the inductance */
    double slow_v;    /* on C2 */
    double mains_rad; /* since the last crossing of two phases, 0...pi/3 */
    bool chopper_enabled, chopper_on;
    bool chopper_asked; /* by the fabric; heard where the chopper has no levels of its own */
    bool plain;         /* R and C only: first order, in closed form (bus.h) */
    double longest_step_s;
    double heat_j, chopper_j; /* in the resistances; in the brake resistor */
};

/* What the bridge draws: a current, and another in proportion to the voltage (both switches of a leg on). A plain supply
 * looks at the current only. */
struct bridge_load {
    double current_a, conductance_s;
};

/* The bus over a step, in means: u = open_v - ohm * current of the bridge. */
struct bus_view {
    double open_v, ohm;
    bool fed; /* the source conducts */
    /* source: feed * feed_ohm = drive_v - u; C2 carries slow_v + slow_ohm * feed */
    double source_v, drive_v, feed_ohm, slow_v, slow_ohm;
};

/* Over a step. */
struct supply_flow {
    double bus_v, source_j; /* mean at the bridge; out of the ideal source */
};

void supply_init(struct supply *s, const struct inverter_params *p);
struct bus_view supply_view(const struct supply *s, const struct inverter_params *p, struct bridge_load load,
                            double dt_s);
/* Takes the step for which the view was made; the load's current is now its mean. */
struct supply_flow supply_step(struct supply *s, const struct inverter_params *p, struct bridge_load load,
                               const struct bus_view *view, double dt_s);
/* Now, with this load. */
double supply_bus_v(const struct supply *s, const struct inverter_params *p, struct bridge_load load);
/* A charge that leaves at once; returns the source's part of its energy. */
double supply_take(struct supply *s, const struct inverter_params *p, double charge_as);
/* In capacitors and the inductance. */
double supply_stored_j(const struct supply *s, const struct inverter_params *p);

#endif
