/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Legs with both switches off: which of the two diodes conducts, or neither. */
#ifndef TWIN_DIODES_H
#define TWIN_DIODES_H

#include "circuit.h"

#define LONGEST_JOINED_STEP_S 0.5e-6 /* with two terminals joined, diodes are settled once a step and not located */
#define DIODE_ZERO_A          1e-6   /* a current below this has ended */

bool diodes_any_off(const struct inverter *inv);
/* Brings those legs into agreement with the motor's currents and voltages. The rounding that is left of a current that
 * has ended is taken out of the motor. */
void diodes_settle(struct inverter *inv, struct motor *motor);

#endif
