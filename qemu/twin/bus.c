/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The equation is linear and of first order, so each stretch is solved in closed form: a small R C costs no steps. */
#include "bus.h"

#include <math.h>

static double connected(const struct bus *bus, double v0_v, double i_a, double dt_s)
{
    if (bus->resistance_ohm == 0) {
        return bus->supply_v;
    }
    double settled_v = bus->supply_v - bus->resistance_ohm * i_a;
    return settled_v + (v0_v - settled_v) * exp(-dt_s / (bus->resistance_ohm * bus->capacitance_f));
}

double bus_voltage_after(const struct bus *bus, double v0_v, double i_a, double dt_s)
{
    if (bus->sinks) {
        return connected(bus, v0_v, i_a, dt_s);
    }
    if (v0_v > bus->supply_v || (v0_v == bus->supply_v && i_a < 0)) {
        double alone_v = v0_v - i_a * dt_s / bus->capacitance_f;
        if (alone_v >= bus->supply_v) {
            return alone_v;
        }
        double until_s = (v0_v - bus->supply_v) * bus->capacitance_f / i_a;
        return connected(bus, bus->supply_v, i_a, dt_s - until_s);
    }
    double fed_v = connected(bus, v0_v, i_a, dt_s);
    if (fed_v <= bus->supply_v) {
        return fed_v;
    }
    /* Fed back beyond the supply: from the crossing on, the capacitor takes it all. */
    double settled_v = bus->supply_v - bus->resistance_ohm * i_a;
    double until_s = bus->resistance_ohm * bus->capacitance_f * log((settled_v - v0_v) / (settled_v - bus->supply_v));
    return bus->supply_v - i_a * (dt_s - until_s) / bus->capacitance_f;
}
