/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The motor integrates its energy to the fourth order. With a supply that is not plain, the books follow it: what went
 * into the motor, into heat and into the nodes says more of the charge out of the bus than the ends of the current, which
 * is no straight line (with 30 uH and 10 us they are off by a thousandth). The plain supply makes do with the ends, so
 * that an ideal plant is what it always was. */
#include "account.h"

#include <math.h>

#include "extremes.h"

#define LEAST_BUS_SHARE 0.1 /* of the supply's voltage: below it, a quotient of energy and voltage says little */

struct bridge_load step_load(const struct inverter *inv, const double i_a[3])
{
    struct bridge_load load = {0, 0};
    for (int k = 0; k < 3; k++) {
        load.current_a += circuit_bus_share(inv->leg[k]) * i_a[k];
        load.conductance_s += inv->leg[k] == LEG_BOTH ? 1 / (2 * inv->p.r_on_ohm) : 0;
    }
    if (inv->supply.plain) {
        load.current_a += load.conductance_s * inv->bus_v;
        load.conductance_s = 0;
    }
    return load;
}

double step_bus_a(const struct bridge_load *load, double bus_v)
{
    return load->current_a + load->conductance_s * bus_v;
}

/* Heat of the switches and diodes over a step in which every current is a straight line. */
static double conduction_j(const struct step *st, double bus_v, double dt_s)
{
    const struct inverter_params *p = &st->inv->p;
    double power_w = 0;
    for (int k = 0; k < 3; k++) {
        double mean_a = (st->i_start_a[k] + st->i_a[k]) / 2, half_a = (st->i_a[k] - st->i_start_a[k]) / 2;
        double square_a2 = mean_a * mean_a + half_a * half_a / 3;
        switch (st->inv->leg[k]) {
        case LEG_HIGH:
        case LEG_LOW:
            power_w += circuit_switch_w(st->inv, k, mean_a, square_a2);
            break;
        case LEG_DIODE_LO:
        case LEG_DIODE_HI:
            power_w += p->diode_v * fabs(mean_a) + p->diode_ohm * square_a2;
            break;
        case LEG_BOTH:
            power_w += (bus_v * bus_v / p->r_on_ohm + p->r_on_ohm * square_a2) / 2;
            break;
        default:
            break;
        }
    }
    return power_w * dt_s;
}

/* Whether all that leaves the bus is in the motor, in heat of the bridge, or in the nodes. */
static bool closes(const struct step *st, double bus_v)
{
    const struct inverter *inv = st->inv;
    bool both = inv->leg[0] == LEG_BOTH || inv->leg[1] == LEG_BOTH || inv->leg[2] == LEG_BOTH;
    return !inv->supply.plain && !both && inv->short_from < 0 && bus_v > LEAST_BUS_SHARE * inv->p.vbus_v;
}

static bool bus_is_idle(const struct inverter *inv)
{
    return circuit_bus_share(inv->leg[0]) + circuit_bus_share(inv->leg[1]) + circuit_bus_share(inv->leg[2]) == 0;
}

/* i (open_v - ohm i) = power */
static double current_for(const struct bus_view *bus, double power_w)
{
    double root_v = sqrt(larger(bus->open_v * bus->open_v - 4 * bus->ohm * power_w, 0));
    return 2 * power_w / (bus->open_v + root_v);
}

struct bridge_load account_step(struct step *st, double stored_j, double dt_s)
{
    struct inverter *inv = st->inv;
    double motor_j = st->motor->energy_in_j - st->start_in_j;
    inv->bus_v = st->bus.open_v - st->bus.ohm * st->load.current_a;
    struct bridge_load mean = step_load(inv, st->i_a);
    double end_a = mean.current_a, half_a = (end_a - st->load.current_a) / 2;
    mean.current_a -= half_a;
    /* the bus sees the mean of the current; this is what the rest of it loses in the bus's resistance */
    double ripple_j = st->bus.ohm * half_a * half_a / 3 * dt_s, bus_v = st->bus.open_v - st->bus.ohm * mean.current_a;
    double heat_j = conduction_j(st, inv->bus_v, dt_s);
    if (closes(st, bus_v) && bus_is_idle(inv)) {
        heat_j = -motor_j - stored_j;
    } else if (closes(st, bus_v)) {
        mean.current_a = current_for(&st->bus, (motor_j + heat_j + stored_j + ripple_j) / dt_s);
    }
    struct supply_flow flow = supply_step(&inv->supply, &inv->p, mean, &st->bus, dt_s);
    inv->supply.heat_j += ripple_j;
    inv->energy_supply_j += flow.source_j;
    inv->energy_bridge_j += flow.bus_v * step_bus_a(&mean, flow.bus_v) * dt_s - ripple_j;
    inv->energy_conduction_j += heat_j;
    mean.current_a = end_a;
    inv->bus_v = supply_bus_v(&inv->supply, &inv->p, mean);
    return mean;
}
