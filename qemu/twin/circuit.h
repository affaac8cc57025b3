/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The bridge as the motor sees it while no leg changes its state: a linear source at every terminal.
 *
 *   high on   v = bus - V_switch sign(i) - R_on i     both off, i > 0     v =     - V_diode - R_diode i
 *   low on    v =     - V_switch sign(i) - R_on i     both off, i < 0     v = bus + V_diode - R_diode i
 *   both on   v = bus/2 - R_on/2 i                    both off, i = 0     floats between the two
 *                                                     both off, swings    v = node - dt/(2 C) i
 *
 * V_switch > 0 is an IGBT: current back through one that is on takes V_diode and R_diode. The last line is the mean of a
 * step by the trapezoidal rule. The bus may fall with the current that the bridge draws. */
#ifndef TWIN_CIRCUIT_H
#define TWIN_CIRCUIT_H

#include "inverter.h"

/* The circuit as it is for one step: a source per terminal and what follows from it. */
struct circuit {
    struct motor_source source; /* by leg */
    double short_gain[3];       /* short current = short_emf_a + sum of short_gain[l] * motor current l */
    double short_emf_a;
};

/* No current can leave this leg. */
bool circuit_floats(const struct inverter *inv, int k);
/* Voltage of a leg that does not float while it carries a current, on the bus as it is. */
double circuit_leg_v(const struct inverter *inv, int k, double i_a);
/* Heat of a switch that conducts, from mean and mean square of its current. */
double circuit_switch_w(const struct inverter *inv, int k, double mean_a, double square_a2);
/* The share of a leg's current that comes from the bus; of a swing, the node's own charge supplies the other half. */
static inline double circuit_bus_share(enum leg_state leg)
{
    static const double share[] = {
        [LEG_HIGH] = 1, [LEG_DIODE_HI] = 1, [LEG_BOTH] = 0.5, [LEG_SWING] = 0.5, [LEG_BLOCKED] = 0};
    return share[leg];
}
/* The largest resistance in series with a phase. */
double circuit_largest_ohm(const struct inverter *inv);
void circuit_build(const struct inverter *inv, const struct bus_view *bus, double dt_s, struct circuit *c);
/* On the bus as it is now. */
void circuit_build_now(const struct inverter *inv, struct circuit *c);
/* Currents out of the legs from those of the motor. */
void circuit_leg_currents(const struct inverter *inv, const struct circuit *c, const double i_motor_a[3],
                          double i_a[3]);

#endif
