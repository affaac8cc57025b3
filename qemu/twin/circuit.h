/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The bridge as the motor sees it while no leg changes its state: a linear source at every terminal.
 *
 *   high on   v = bus - R_on i            both off, i > 0   v = -V_diode
 *   low on    v =     - R_on i            both off, i < 0   v = bus + V_diode
 *   both on   v = bus/2 - R_on/2 i        both off, i = 0   floats while -V_diode < v < bus + V_diode
 */
#ifndef TWIN_CIRCUIT_H
#define TWIN_CIRCUIT_H

#include "inverter.h"

/* The circuit as it is for one step: a source per terminal and what follows from it. */
struct circuit {
    struct motor_source source;
    double short_gain[3]; /* short current = short_emf_a + sum of short_gain[l] * motor current l */
    double short_emf_a;
    double r_max_ohm;
};

/* No current can leave this leg. */
bool circuit_floats(const struct inverter *inv, int k);
void circuit_leg_source(const struct inverter *inv, int k, double *emf_v, double *r_ohm);
void circuit_build(const struct inverter *inv, struct circuit *c);
/* Currents out of the legs from those of the motor. */
void circuit_leg_currents(const struct inverter *inv, const struct circuit *c, const double i_motor_a[3],
                          double i_a[3]);

#endif
