/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "terminals.h"

#include <math.h>

static bool exchanged(const struct inverter *inv)
{
    return inv->feeds[0] != 0 || inv->feeds[1] != 1;
}

/* From the order of the legs to that of the motor's phases, or back: exchanging two is its own inverse. */
static void reorder(const struct inverter *inv, const double from[3], double to[3])
{
    for (int k = 0; k < 3; k++) {
        to[inv->feeds[k]] = from[k];
    }
}

static struct motor_source by_phase(const struct inverter *inv, const struct motor_source *by_leg)
{
    struct motor_source s;
    for (int k = 0; k < 3; k++) {
        int phase = inv->feeds[k];
        s.emf_v[phase] = by_leg->emf_v[k];
        s.held[phase] = by_leg->held[k];
        reorder(inv, by_leg->r_ohm[k], s.r_ohm[phase]);
    }
    return s;
}

void terminals_currents(const struct inverter *inv, const struct motor *motor, double i_a[3])
{
    motor_currents(motor, i_a);
    if (exchanged(inv)) {
        double i_phase_a[3] = {i_a[0], i_a[1], i_a[2]};
        reorder(inv, i_phase_a, i_a);
    }
}

void terminals_step(const struct inverter *inv, struct motor *motor, const struct motor_source *source, double dt_s)
{
    if (exchanged(inv)) {
        struct motor_source s = by_phase(inv, source);
        motor_step(motor, &s, dt_s);
    } else {
        motor_step(motor, source, dt_s);
    }
}

void terminals_star_voltages(const struct inverter *inv, const struct motor *motor, const struct motor_source *source,
                             double v_v[3])
{
    if (!exchanged(inv)) {
        motor_star_voltages(motor, source, v_v);
        return;
    }
    struct motor_source s = by_phase(inv, source);
    double v_phase_v[3];
    motor_star_voltages(motor, &s, v_phase_v);
    reorder(inv, v_phase_v, v_v);
}

void terminals_hold(const struct inverter *inv, struct motor *motor, int leg)
{
    motor_hold_phase(motor, inv->feeds[leg]);
}

double terminals_inductance_h(const struct motor *motor)
{
    return motor_min_inductance_h(motor);
}
