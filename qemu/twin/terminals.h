/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The motor as the legs of the bridge see it: by leg, also when wires are exchanged at its terminals. */
#ifndef TWIN_TERMINALS_H
#define TWIN_TERMINALS_H

#include "inverter.h"

void terminals_currents(const struct inverter *inv, const struct motor *motor, double i_a[3]);
void terminals_step(const struct inverter *inv, struct motor *motor, const struct motor_source *source, double dt_s);
void terminals_star_voltages(const struct inverter *inv, const struct motor *motor, const struct motor_source *source,
                             double v_v[3]);
void terminals_hold(const struct inverter *inv, struct motor *motor, int leg);
/* The smaller inductance of a phase: what limits how fast a current changes. */
double terminals_inductance_h(const struct motor *motor);

#endif
