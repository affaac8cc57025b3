/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "modelbench.h"

/* What turns the shaft slowly through one revolution, moment by moment. */
void measure_cogging(const struct modelbench *b)
{
    const double speed_rad_s = 20;
    struct motor m = bench_motor_at(b, 0);
    double low_nm = INFINITY, high_nm = -INFINITY;
    motor_spin(&m, speed_rad_s);
    while (m.theta_rad < 2 * PI) {
        double before_j = m.energy_driver_j, dt_s = bench_step_s(&m);
        motor_step(&m, &open_terminals, dt_s);
        double driver_nm = (m.energy_driver_j - before_j) / (speed_rad_s * dt_s);
        low_nm = fmin(low_nm, driver_nm);
        high_nm = fmax(high_nm, driver_nm);
    }
    report("cogging_peak_to_peak", high_nm - low_nm, "Nm");
}

/* One revolution at speed, nothing connected. */
bool measure_drag(const struct modelbench *b, const char *rpm)
{
    char *end;
    double speed_rad_s = strtod(rpm, &end) * RAD_S_PER_RPM;
    if (end == rpm || *end != '\0' || !(speed_rad_s > 0) || !isfinite(speed_rad_s)) {
        return false;
    }
    struct motor m = bench_motor_at(b, 0);
    double turn_s = 2 * PI / speed_rad_s;
    motor_spin(&m, speed_rad_s);
    run(&m, &open_terminals, turn_s);
    report_at("drag_torque", rpm, m.energy_driver_j / (2 * PI), "Nm");
    report_at("iron_power", rpm, m.energy_iron_j / turn_s, "W");
    return true;
}

/* ---- two masses ---- */

/* Mean frequency of the twist after a pluck; friction that could hold a mass is left out. */
static double ringing_hz(const struct modelbench *b, bool hold_motor)
{
    struct motor_params p = bench_params(b);
    struct load_params load = b->load;
    struct motor m;
    p.friction_coulomb_nm = p.cogging_nm = p.cogging2_nm = p.cogging3_nm = 0;
    load.coulomb_nm = load.stiction_nm = 0;
    motor_init(&m, &p, &load);
    m.twist_rad = 1e-3;
    if (hold_motor) {
        motor_lock(&m, true);
    }
    double first_s = 0, last_s = 0, before, t_s = 0;
    int crossings = 0;
    for (int n = 0; crossings < 20 && n < 10000000; n++) {
        double dt_s = bench_step_s(&m);
        before = m.twist_rad;
        motor_step(&m, &open_terminals, dt_s);
        t_s += dt_s;
        if (before < 0 && m.twist_rad >= 0) {
            last_s = t_s - dt_s * m.twist_rad / (m.twist_rad - before);
            first_s = crossings++ == 0 ? last_s : first_s;
        }
    }
    return (crossings - 1) / (last_s - first_s);
}

void measure_two_masses(const struct modelbench *b)
{
    report("two_mass_resonance", ringing_hz(b, false), "Hz");
    report("two_mass_antiresonance", ringing_hz(b, true), "Hz");
}

/* ---- the balance of energy ---- */

/* The voltage that leads the currents to the wanted ones at the present speed. */
static struct motor_source towards(const struct motor *m, struct dq wanted_a)
{
    double w_e = m->p.pole_pairs * m->speed_rad_s, r_ohm = motor_resistance_ohm(m);
    struct dq v = {r_ohm * wanted_a.d - w_e * m->psi_vs.q, r_ohm * wanted_a.q + w_e * m->psi_vs.d};
    return voltage_vector(hypot(v.d, v.q), m->p.pole_pairs * m->theta_rad + atan2(v.q, v.d));
}

static bool at_full_voltage(const struct modelbench *b, const struct motor *m)
{
    double emf_v = m->p.pole_pairs * fabs(m->speed_rad_s) * hypot(m->psi_vs.d, m->psi_vs.q);
    return emf_v > 0.8 * b->bus_v / SQRT3;
}

/* Forwards, with a little field weakening, through zero to the other side, and free: a quarter of a second each, or until
 * the bus is used up. A light load pulls all the time. */
void measure_balance(const struct modelbench *b)
{
    const double rated_a = b->rated_a > 0 ? b->rated_a : 1;
    const struct dq phases[] = {{0, rated_a}, {-0.5 * rated_a, 0.8 * rated_a}, {-0.3 * rated_a, -rated_a}, {0, 0}};
    struct motor m;
    motor_init(&m, &b->motor, &b->load);
    m.load_nm = 0.1 * b->torque_constant * rated_a;
    double start_j = motor_mechanical_energy_j(&m) + motor_magnetic_energy_j(&m), turnover_j = 0;
    for (int n = 0; n < 4; n++) {
        bool was_full = at_full_voltage(b, &m);
        for (double t_s = 0; t_s < 0.25 && (was_full || !at_full_voltage(b, &m));) {
            double dt_s = bench_step_s(&m), before_j = m.energy_in_j;
            struct motor_source s = towards(&m, phases[n]);
            motor_step(&m, &s, dt_s);
            turnover_j += fabs(m.energy_in_j - before_j);
            t_s += dt_s;
            was_full = was_full && at_full_voltage(b, &m);
        }
    }
    double stored_j = motor_mechanical_energy_j(&m) + motor_magnetic_energy_j(&m) - start_j;
    double spent_j = m.energy_copper_j + m.energy_iron_j + m.energy_friction_j + m.energy_load_j;
    report("energy_balance_error", fabs(m.energy_in_j - spent_j - stored_j) / turnover_j, "-");
}
