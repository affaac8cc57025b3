/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What can be seen from outside of a leg: the current in its lower branch, and at which rail its terminal is. Inline: asked
 * for every leg at every step. */
#ifndef TWIN_LEGS_H
#define TWIN_LEGS_H

#include "inverter.h"

/* Current out of leg k that comes through its low side, switch or diode: what a shunt below it carries. */
static inline double leg_low_side_a(const struct inverter *inv, int k, double i_leg_a)
{
    switch (inv->leg[k]) {
    case LEG_LOW:
    case LEG_DIODE_LO:
        return i_leg_a;
    case LEG_BOTH:
        return i_leg_a / 2 - inv->bus_v / (2 * inv->p.r_on_ohm);
    case LEG_JUST_OFF: /* the lower diode takes over what flows out */
        return i_leg_a > 0 ? i_leg_a : 0;
    case LEG_SWING: /* the two output capacitances share it */
        return i_leg_a / 2;
    default:
        return 0;
    }
}

/* 1 at the upper rail, -1 at the lower, 0 between. */
static inline int leg_level(const struct inverter *inv, int k)
{
    switch (inv->leg[k]) {
    case LEG_HIGH:
    case LEG_DIODE_HI:
        return 1;
    case LEG_LOW:
    case LEG_DIODE_LO:
        return -1;
    default:
        return 0;
    }
}

#endif
