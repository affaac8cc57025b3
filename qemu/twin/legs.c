/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "legs.h"

#include <math.h>

double leg_low_side_a(const struct inverter *inv, int k, double i_leg_a)
{
    switch (inv->leg[k]) {
    case LEG_LOW:
    case LEG_DIODE_LO:
        return i_leg_a;
    case LEG_BOTH:
        return i_leg_a / 2 - inv->bus_v / (2 * inv->p.r_on_ohm);
    case LEG_JUST_OFF:
        return fmax(i_leg_a, 0); /* the lower diode takes over what flows out */
    default:
        return 0;
    }
}

int leg_level(const struct inverter *inv, int k)
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
