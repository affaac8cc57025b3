/* SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>

#include "modelbench.h"

#define BENCH_TIME_CONSTANT_S 0.02 /* mechanical, wherever only the steady state is read */

/* Locked rotor on a DC voltage: the best position, and the mean over the 60 degrees that one commutation lasts. */
static void stall(const struct modelbench *b)
{
    double best_nm = 0, sum_nm = 0, i_a[3] = {0};
    const int positions = 61;
    for (int n = 0; n < positions; n++) {
        /* Current from A to B stands at -30 degrees; the rotor turns through 60 to 120 degrees behind it. */
        struct motor m = bench_motor_at(b, -PI / 6 - PI / 3 - PI / 3 * n / (positions - 1));
        struct motor_source s = two_terminals(b->bus_v);
        settle(&m, &s);
        motor_currents(&m, i_a);
        best_nm = fmax(best_nm, motor_torque_nm(&m));
        sum_nm += motor_torque_nm(&m) * (n == 0 || n == positions - 1 ? 0.5 : 1);
    }
    double mean_nm = sum_nm / (positions - 1);
    report("stall_current", i_a[0], "A");
    report("stall_torque_six_step_best", best_nm, "Nm");
    report("stall_torque_six_step_mean", mean_nm, "Nm");
    report("torque_constant_six_step", mean_nm / i_a[0], "Nm/A");
}

static double electrical_angle(const struct motor *m)
{
    return m->p.pole_pairs * m->theta_rad;
}

/* The two terminals whose current leads the rotor by 60 to 120 degrees. */
static struct motor_source six_step(const struct motor *m, double bus_v)
{
    static const int from[6] = {0, 0, 1, 1, 2, 2}, to[6] = {1, 2, 2, 0, 0, 1};
    /* Sector n drives a current at -30 + 60 n degrees; it serves the rotor from -150 + 60 n to -90 + 60 n. */
    double turns = (electrical_angle(m) + 5 * PI / 6) / (2 * PI);
    int n = (int)floor(6 * (turns - floor(turns))) % 6;
    struct motor_source s = {.held = {true, true, true}};
    s.emf_v[from[n]] = bus_v;
    s.held[from[n]] = false;
    s.held[to[n]] = false;
    return s;
}

static struct motor_source sine(const struct motor *m, double bus_v)
{
    double v = bus_v / SQRT3, lead = electrical_angle(m) + PI / 2;
    return phase_voltages(v * cos(lead), v * cos(lead - 2 * PI / 3), v * cos(lead + 2 * PI / 3));
}

typedef struct motor_source (*drive_fn)(const struct motor *, double bus_v);

/* Mean speed over a stretch of time; adds up what the positive rail delivers. */
static double drive(struct motor *m, drive_fn commutate, double bus_v, double duration_s, double *mean_dc_a)
{
    double started_rad = m->theta_rad, charge_as = 0, t_s = 0;
    while (t_s < duration_s) {
        double dt_s = fmin(bench_step_s(m), 0.002 / (fabs(m->speed_rad_s) * m->p.pole_pairs + 1));
        struct motor_source s = commutate(m, bus_v);
        double energy_j = m->energy_in_j;
        motor_step(m, &s, dt_s);
        charge_as += (m->energy_in_j - energy_j) / bus_v;
        t_s += dt_s;
    }
    *mean_dc_a = charge_as / t_s;
    return (m->theta_rad - started_rad) / t_s;
}

/* The steady state does not depend on the inertia: a lighter rotor only gets there sooner. */
static void lighten(const struct modelbench *b, struct motor *m)
{
    double k_t = b->torque_constant, time_constant_s = 1.5 * m->p.inertia_kgm2 * b->phase_ohm / (k_t * k_t);
    if (time_constant_s > BENCH_TIME_CONSTANT_S) {
        m->p.inertia_kgm2 *= BENCH_TIME_CONSTANT_S / time_constant_s;
    }
}

static struct motor resting(const struct modelbench *b)
{
    return bench_motor_at(b, b->motor.initial_angle_rad * b->motor.pole_pairs);
}

static double no_load(const struct modelbench *b, drive_fn commutate, double *dc_a)
{
    struct motor m = resting(b);
    lighten(b, &m);
    double speed = 0, before;
    int rounds = 0;
    do {
        before = speed;
        speed = drive(&m, commutate, b->bus_v, 5 * BENCH_TIME_CONSTANT_S, dc_a);
    } while (fabs(speed - before) > 1e-4 * fabs(speed) + 1e-9 && ++rounds < 40);
    return speed;
}

/* Time to 63.2 % of the no-load speed from standstill with the true inertia. */
static double start_time(const struct modelbench *b, double no_load_rad_s)
{
    struct motor m = resting(b);
    double t_s = 0, dc_a;
    while (m.speed_rad_s < 0.632120559 * no_load_rad_s && t_s < 20) {
        double slice_s = 20e-6;
        drive(&m, six_step, b->bus_v, slice_s, &dc_a);
        t_s += slice_s;
    }
    return t_s;
}

void measure_on_bus(const struct modelbench *b)
{
    double dc_a;
    stall(b);
    double six_step_rad_s = no_load(b, six_step, &dc_a);
    report("no_load_speed_six_step", six_step_rad_s / RAD_S_PER_RPM, "rpm");
    report("no_load_current_six_step", dc_a, "A");
    report("mechanical_time_constant", start_time(b, six_step_rad_s), "s");
    report("no_load_speed_sine", no_load(b, sine, &dc_a) / RAD_S_PER_RPM, "rpm");
}
