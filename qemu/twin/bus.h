/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The bus capacitor and the supply behind its resistance. */
#ifndef TWIN_BUS_H
#define TWIN_BUS_H

#include <stdbool.h>

struct bus {
    double supply_v;
    double resistance_ohm;
    double capacitance_f;
    bool sinks;
};

/* Voltage after dt_s while the bridge draws the constant current i_a: C dv/dt = (supply - v) / R - i, exactly. A supply
 * that does not sink is disconnected while the bus is above it. */
double bus_voltage_after(const struct bus *bus, double v0_v, double i_a, double dt_s);

#endif
