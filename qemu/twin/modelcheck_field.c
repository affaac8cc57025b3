/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "modelbench.h"

#define POSITIONS 36 /* over 60 electrical degrees: harmonics of order 6, 12 and 18 average out */

/* ---- EMF ---- */

/* Amplitudes of sin n theta in minus the voltage of phase A, at 1000 rpm. */
static void emf_spectrum(struct motor *m, const int *orders, int count, double *amplitude_v)
{
    const int samples = 3600;
    double turn_s = 60.0 / 1000 / m->p.pole_pairs, v[3];
    motor_spin(m, 1000 * RAD_S_PER_RPM);
    for (int k = 0; k < count; k++) {
        amplitude_v[k] = 0;
    }
    for (int n = 0; n < samples; n++) {
        run(m, &open_terminals, turn_s / samples);
        motor_star_voltages(m, &open_terminals, v);
        for (int k = 0; k < count; k++) {
            amplitude_v[k] -= v[0] * sin(orders[k] * m->p.pole_pairs * m->theta_rad) * 2 / samples;
        }
    }
}

static double magnet_tempco(const struct modelbench *b)
{
    const int fundamental = 1;
    const double degrees[2] = {REFERENCE_C, 100};
    double v[2];
    for (int n = 0; n < 2; n++) {
        struct motor_params p = bench_params(b);
        struct load_params no_load = {0};
        struct motor m;
        p.magnet_tempco_per_k = b->motor.magnet_tempco_per_k;
        p.ambient_c = degrees[n];
        motor_init(&m, &p, &no_load);
        emf_spectrum(&m, &fundamental, 1, &v[n]);
    }
    return (v[1] / v[0] - 1) / (degrees[1] - degrees[0]) * 100;
}

void measure_emf(struct modelbench *b)
{
    static const int orders[] = {1, 5, 7, 11, 13, 17, 19};
    double v[7], rad_s = 1000 * RAD_S_PER_RPM;
    struct motor m = bench_motor_at(b, 0);
    emf_spectrum(&m, orders, 7, v);
    b->open_circuit_vs = v[0] / (rad_s * m.p.pole_pairs);
    report("back_emf_line_line_peak", v[0] * SQRT3, "V/krpm");
    report("back_emf_line_line_rms", v[0] * SQRT3 / sqrt(2), "V/krpm");
    report("back_emf_phase_peak", v[0] / rad_s, "Vs/rad");
    report("open_circuit_flux", b->open_circuit_vs, "Wb");
    for (int k = 1; k < 7 && v[0] > 0; k++) {
        char name[40];
        snprintf(name, sizeof name, "emf_harmonic_%d", orders[k]);
        if (fabs(v[k] / v[0]) > 1e-6) {
            report(name, v[k] / v[0] * 100, "%");
        }
    }
    if (v[0] > 0) {
        report("magnet_tempco", magnet_tempco(b), "%/K");
    }
}

/* ---- resistance and inductance ---- */

static double rated_or_1_a(const struct modelbench *b)
{
    return b->rated_a > 0 ? b->rated_a : 1;
}

static double resistance(const struct modelbench *b)
{
    struct motor m = bench_motor_at(b, 0);
    double i_a[3], applied_v = 1;
    struct motor_source s = two_terminals(applied_v);
    settle(&m, &s);
    motor_currents(&m, i_a);
    return applied_v / i_a[0];
}

/* Inductance seen along the magnetic axis of phase A from two samples of a small voltage step: i2/i1 = 1 + exp(-t/tau). */
static double inductance(const struct modelbench *b, double rotor_angle_rad, double axis_rad)
{
    double i1_a[3], i2_a[3], v = 1e-3 * rated_or_1_a(b) * b->phase_ohm;
    struct motor m = bench_motor_at(b, rotor_angle_rad);
    motor_lock(&m, true);
    struct motor_source s = voltage_vector(v, rotor_angle_rad + axis_rad);
    double t_s = motor_max_step_s(&m, 0);
    run(&m, &s, t_s);
    motor_currents(&m, i1_a);
    run(&m, &s, t_s);
    motor_currents(&m, i2_a);
    double axis_c = cos(rotor_angle_rad + axis_rad), axis_s = sin(rotor_angle_rad + axis_rad);
    double i1 = i1_a[0] * axis_c + (i1_a[1] - i1_a[2]) / SQRT3 * axis_s;
    double i2 = i2_a[0] * axis_c + (i2_a[1] - i2_a[2]) / SQRT3 * axis_s;
    return -t_s / log(i2 / i1 - 1) * b->phase_ohm;
}

/* Over the position: the mean of 1/L, and how much of it varies six and twelve times a turn. */
struct over_position {
    double mean_h, six, twelve;
};

static struct over_position inductance_over_position(const struct modelbench *b, double axis_rad)
{
    double sum = 0, sum_6 = 0, sum_12 = 0;
    for (int n = 0; n < POSITIONS; n++) {
        double angle_rad = PI / 3 * n / POSITIONS, per_h = 1 / inductance(b, angle_rad, axis_rad);
        sum += per_h;
        sum_6 += per_h * cos(6 * angle_rad);
        sum_12 += per_h * cos(12 * angle_rad);
    }
    return (struct over_position){POSITIONS / sum, 2 * sum_6 / sum, 2 * sum_12 / sum};
}

void measure_winding(struct modelbench *b)
{
    double line_line_ohm = resistance(b);
    b->phase_ohm = line_line_ohm / 2;
    struct over_position d = inductance_over_position(b, 0), q = inductance_over_position(b, PI / 2);
    report("resistance_line_line", line_line_ohm, "ohm");
    report("inductance_d", d.mean_h, "H");
    report("inductance_q", q.mean_h, "H");
    report("inductance_line_line_mean", d.mean_h + q.mean_h, "H");
    report("permeance_6", 100 * d.six, "%");
    report("permeance_12", 100 * d.twelve, "%");
}

/* ---- torque ---- */

struct torque {
    double mean_nm, peak_to_peak_nm;
};

/* With a steady q-axis current of the given peak value, over the position. */
static struct torque torque_at(const struct modelbench *b, double peak_a)
{
    double sum_nm = 0, low_nm = INFINITY, high_nm = -INFINITY;
    for (int n = 0; n < POSITIONS; n++) {
        double angle_rad = PI / 3 * n / POSITIONS;
        struct motor m = bench_motor_at(b, angle_rad);
        struct motor_source s = voltage_vector(peak_a * b->phase_ohm, angle_rad + PI / 2);
        settle(&m, &s);
        sum_nm += motor_torque_nm(&m);
        low_nm = fmin(low_nm, motor_torque_nm(&m));
        high_nm = fmax(high_nm, motor_torque_nm(&m));
    }
    return (struct torque){sum_nm / POSITIONS, high_nm - low_nm};
}

void measure_torque(struct modelbench *b)
{
    double peak_a = rated_or_1_a(b);
    struct torque torque = torque_at(b, peak_a);
    b->torque_constant = torque.mean_nm / peak_a;
    report("torque_constant_peak", b->torque_constant, "Nm/A");
    report("torque_constant_rms", b->torque_constant * sqrt(2), "Nm/A");
    if (b->rated_a > 0) {
        report("rated_torque", torque.mean_nm, "Nm");
        if (torque.mean_nm > 0) {
            report("torque_ripple_rated", 100 * torque.peak_to_peak_nm / torque.mean_nm, "%");
        }
    }
}

/* What cogging adds at an angle: minus the slope of its potential. */
static double cogging_at(const struct modelbench *b, double electrical_rad)
{
    const double h = 1e-5;
    struct motor ahead = bench_motor_at(b, electrical_rad + h), behind = bench_motor_at(b, electrical_rad - h);
    return -(motor_mechanical_energy_j(&ahead) - motor_mechanical_energy_j(&behind)) * b->motor.pole_pairs / (2 * h);
}

/* Torque on the shaft over the position at constant currents: from the least to the largest, and its 18th harmonic. */
static void report_ripple(const struct modelbench *b, const char *point, struct dq i)
{
    double low_nm = INFINITY, high_nm = -INFINITY, cos_nm = 0, sin_nm = 0;
    const int positions = 2 * POSITIONS;
    for (int n = 0; n < positions; n++) {
        double angle_rad = PI / 3 * n / positions;
        struct motor m = bench_motor_at(b, angle_rad);
        struct motor_source s = voltage_vector(hypot(i.d, i.q) * b->phase_ohm, angle_rad + atan2(i.q, i.d));
        settle(&m, &s);
        double torque_nm = motor_torque_nm(&m) + cogging_at(b, angle_rad);
        low_nm = fmin(low_nm, torque_nm);
        high_nm = fmax(high_nm, torque_nm);
        cos_nm += torque_nm * cos(18 * angle_rad) * 2 / positions;
        sin_nm += torque_nm * sin(18 * angle_rad) * 2 / positions;
    }
    report_at("map_ripple", point, high_nm - low_nm, "Nm");
    report_at("map_ripple_18", point, hypot(cos_nm, sin_nm), "Nm");
}

/* ---- the flux map ---- */

/* Flux linkage that a step adds: what the terminals saw less the drop at the resistance. */
struct linked {
    struct dq current_a, flux_vs;
};

static struct dq rotor_current(const struct motor *m)
{
    double i_a[3];
    motor_currents(m, i_a); /* the rotor is held at angle 0: d is phase A's axis */
    return (struct dq){i_a[0], (i_a[1] - i_a[2]) / SQRT3};
}

/* Adds up in steps of a fortieth of the time constant. Stops when the currents stay, or after duration_s. */
static struct linked link_flux(const struct modelbench *b, struct motor *m, struct dq v, double duration_s)
{
    struct motor_source s = phase_voltages(v.d, -v.d / 2 + SQRT3 / 2 * v.q, -v.d / 2 - SQRT3 / 2 * v.q);
    struct dq start = rotor_current(m), i = start, flux = {0, 0};
    double t_s = 0, change_a, dt_s;
    do {
        struct dq before = i;
        dt_s = fmin(bench_step_s(m), duration_s - t_s);
        motor_step(m, &s, dt_s);
        i = rotor_current(m);
        flux.d += (v.d - b->phase_ohm * (before.d + i.d) / 2) * dt_s;
        flux.q += (v.q - b->phase_ohm * (before.q + i.q) / 2) * dt_s;
        t_s += dt_s;
        change_a = fabs(i.d - before.d) + fabs(i.q - before.q);
    } while (t_s < duration_s && (isfinite(duration_s) || change_a > 1e-9 * (fabs(i.d) + fabs(i.q))));
    return (struct linked){{i.d - start.d, i.q - start.q}, flux};
}

static bool read_point(const char *text, struct dq *i)
{
    char *end;
    i->d = strtod(text, &end);
    if (end == text || *end != ',') {
        return false;
    }
    text = end + 1;
    i->q = strtod(text, &end);
    return end != text && *end == '\0' && isfinite(i->d) && isfinite(i->q);
}

/* Two small steps of voltage from the settled point give the incremental inductances. */
static void report_incremental(const struct modelbench *b, const struct motor *m, const char *point, struct dq v)
{
    double small_v = 0.01 * (fabs(v.d) + fabs(v.q) + rated_or_1_a(b) * b->phase_ohm), t_s = motor_max_step_s(m, 0);
    struct motor along_d = *m, along_q = *m;
    struct linked d = link_flux(b, &along_d, (struct dq){v.d + small_v, v.q}, t_s);
    struct linked q = link_flux(b, &along_q, (struct dq){v.d, v.q + small_v}, t_s);
    double det = d.current_a.d * q.current_a.q - d.current_a.q * q.current_a.d;
    report_at("map_l_dd", point, (d.flux_vs.d * q.current_a.q - q.flux_vs.d * d.current_a.q) / det, "H");
    report_at("map_l_dq", point, (q.flux_vs.d * d.current_a.d - d.flux_vs.d * q.current_a.d) / det, "H");
    report_at("map_l_qq", point, (q.flux_vs.q * d.current_a.d - d.flux_vs.q * q.current_a.d) / det, "H");
}

bool measure_map(const struct modelbench *b, const char *point)
{
    struct dq i;
    if (!read_point(point, &i)) {
        return false;
    }
    struct modelbench smooth = *b;
    struct motor_params *p = &smooth.motor;
    p->emf_5 = p->emf_7 = p->emf_11 = p->emf_13 = p->emf_17 = p->emf_19 = p->permeance_6 = p->permeance_12 = 0;
    memset(&p->slots6_xx, 0, SLOT_ORDERS * SLOT_FORMS * sizeof p->slots6_xx);
    struct motor m = bench_motor_at(&smooth, 0);
    struct dq v = {i.d * b->phase_ohm, i.q * b->phase_ohm};
    motor_lock(&m, true);
    struct linked linked = link_flux(b, &m, v, INFINITY);
    report_at("map_psi_d", point, b->open_circuit_vs + linked.flux_vs.d, "Vs");
    report_at("map_psi_q", point, linked.flux_vs.q, "Vs");
    report_at("map_torque", point, motor_torque_nm(&m), "Nm");
    report_incremental(b, &m, point, v);
    report_ripple(b, point, i);
    return true;
}
