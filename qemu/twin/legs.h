/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What can be seen from outside of a leg: the current in its lower branch, and at which rail its terminal is. */
#ifndef TWIN_LEGS_H
#define TWIN_LEGS_H

#include "inverter.h"

/* Current out of leg k that comes through its low side, switch or diode: what a shunt below it carries. */
double leg_low_side_a(const struct inverter *inv, int k, double i_leg_a);
/* 1 at the upper rail, -1 at the lower, 0 between. */
int leg_level(const struct inverter *inv, int k);

#endif
