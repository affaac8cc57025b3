/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The saturation map: points of three machines as published (or worked out with motulator's own code from the published
 * coefficients), and what must hold of any map: each current has one flux linkage, cross-coupling is the same both ways,
 * no closed path of the flux linkage yields energy. */
#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

struct machine {
    const char *name;
    const struct motor_params *p;
    double i_max_a;
};

static const struct machine machines[] = {
    {"SyRM", &bench_syrm, 22}, {"Baldor", &bench_baldor, 20}, {"THOR", &bench_thor, 44}};

static struct motor machine_at(const struct motor_params *p, double i_d_a, double i_q_a)
{
    struct motor m;
    motor_init(&m, p, &bench_no_load);
    if (!motor_set_current(&m, i_d_a, i_q_a)) {
        m.psi_vs = (struct dq){NAN, NAN};
    }
    return m;
}

/* ---- published points ---- */

struct point {
    const struct motor_params *p;
    const char *name;
    double i_d_a, i_q_a, psi_d_vs, psi_q_vs;
    double flux_tolerance;                                     /* relative to the larger flux linkage */
    double l_dd_mh, l_dq_mh, l_qq_mh, inductance_tolerance_mh; /* 0: not published */
    double torque_nm, torque_tolerance_nm;                     /* 0: not published */
};

static const struct point points[] = {
    {&bench_syrm, "SyRM 0, 0", 0, 0, 0, 0, 1e-3, 57.5, 0, 19.2, 0.05, 0, 0},
    {&bench_syrm, "SyRM 10, 10", 10, 10, 0.4213, 0.0767, 1e-3, 20.6, -1.73, 5.67, 0.05, 10.34, 0.01},
    {&bench_syrm, "SyRM 15.5, 15.5", 15.5, 15.5, 0.4964, 0.0962, 1e-3, 11.5, -1.36, 4.62, 0.05, 18.6, 0.05},
    {&bench_syrm, "SyRM 22, 22", 22, 22, 0.5488, 0.1158, 1e-3, 7.6, -1.1, 3.9, 0.05, 28.6, 0.05},
    {&bench_baldor, "Baldor 0, 0", 0, 0, 0.4767, 0, 1e-3, 29.8, 0, 149.7, 0.05, 0, 0},
    {&bench_baldor, "Baldor 0, 12.4", 0, 12.4, 0.4510, 1.0336, 1e-3, 19.4, -2.89, 29.8, 0.05, 16.8, 0.05},
    {&bench_baldor, "Baldor -8, 9.5", -8, 9.5, 0.3038, 0.9375, 1e-3, 18.0, 0.74, 45.1, 0.05, 31.2, 0.05},
    {&bench_baldor, "Baldor -6, 6, measured", -6, 6, 0.3411, 0.7192, 0.04, 0, 0, 0, 0, 0, 0},
    {&bench_baldor, "Baldor -12, 12, measured", -12, 12, 0.2419, 1.0207, 0.04, 0, 0, 0, 0, 0, 0},
    {&bench_thor, "THOR 0, 0, FE", 0, 0, 0.1334, 0, 0.02, 0, 0, 0, 0, 0, 0},
    {&bench_thor, "THOR 0, 11, FE", 0, 11, 0.1506, 0.2888, 0.02, 6.0, 2.0, 13.9, 0.9, 0, 0},
    {&bench_thor, "THOR 0, 22, FE", 0, 22, 0.1643, 0.3848, 0.02, 5.0, 0.5, 5.3, 0.4, 0, 0},
    {&bench_thor, "THOR -22, 22, FE", -22, 22, 0.0745, 0.3644, 0.02, 0, 0, 0, 0, 0, 0},
    {&bench_thor, "THOR -44, 44, FE", -44, 44, 0.0252, 0.4456, 0.02, 0, 0, 0, 0, 0, 0},
    {&bench_thor, "THOR -15, 16, FE", -15, 16, NAN, NAN, 0, 3.6, 1.36, 10.0, 0.4, 19, 0.6},
};

/* dpsi/di by central differences. */
static void incremental(const struct point *at, double l_mh[3])
{
    const double h = 1e-4;
    struct motor d0 = machine_at(at->p, at->i_d_a - h, at->i_q_a), d1 = machine_at(at->p, at->i_d_a + h, at->i_q_a);
    struct motor q0 = machine_at(at->p, at->i_d_a, at->i_q_a - h), q1 = machine_at(at->p, at->i_d_a, at->i_q_a + h);
    l_mh[0] = (d1.psi_vs.d - d0.psi_vs.d) / (2 * h) * 1e3;
    l_mh[1] = (q1.psi_vs.d - q0.psi_vs.d) / (2 * h) * 1e3;
    l_mh[2] = (q1.psi_vs.q - q0.psi_vs.q) / (2 * h) * 1e3;
}

static void published(void)
{
    for (size_t n = 0; n < sizeof points / sizeof points[0]; n++) {
        const struct point *at = &points[n];
        char name[100];
        struct motor m = machine_at(at->p, at->i_d_a, at->i_q_a);
        if (!isnan(at->psi_d_vs)) {
            double scale = hypot(at->psi_d_vs, at->psi_q_vs) + 1e-3;
            snprintf(name, sizeof name, "%s: flux linkages (relative)", at->name);
            check_near(name, hypot(m.psi_vs.d - at->psi_d_vs, m.psi_vs.q - at->psi_q_vs) / scale, 0,
                       at->flux_tolerance);
        }
        if (at->inductance_tolerance_mh > 0) {
            double l_mh[3];
            incremental(at, l_mh);
            snprintf(name, sizeof name, "%s: incremental inductances, worst (mH)", at->name);
            check_near(
                name, fmax(fabs(l_mh[0] - at->l_dd_mh), fmax(fabs(l_mh[1] - at->l_dq_mh), fabs(l_mh[2] - at->l_qq_mh))),
                0, at->inductance_tolerance_mh);
        }
        if (at->torque_tolerance_nm > 0) {
            snprintf(name, sizeof name, "%s: torque (N m)", at->name);
            check_near(name, motor_torque_nm(&m), at->torque_nm, at->torque_tolerance_nm);
        }
    }
}

/* ---- the equations once more, as published, with pow() ---- */

static void published_current(const struct motor_params *p, double d, double q, double *i_d, double *i_q)
{
    double s = p->sat_s, t = p->sat_t, u = p->sat_u, v = p->sat_v, w = p->sat_w;
    double x = sqrt((d - p->sat_psi_n_wb) * (d - p->sat_psi_n_wb) + p->sat_k_q * q * q);
    double bridge = p->sat_a_b * pow(x, w) / (1 + p->sat_a_bp * pow(x, w));
    *i_d = d * (p->sat_a_d0 + p->sat_a_dd * pow(fabs(d), s) +
                p->sat_a_dq / (v + 2) * pow(fabs(d), u) * pow(fabs(q), v + 2)) +
           bridge * (d - p->sat_psi_n_wb) - p->sat_i_f_a;
    *i_q = q * (p->sat_a_q0 + p->sat_a_qq * pow(fabs(q), t) +
                p->sat_a_dq / (u + 2) * pow(fabs(d), u + 2) * pow(fabs(q), v)) +
           p->sat_k_q * bridge * q;
}

/* Exponents of every size, with both kinds of magnet. */
static struct motor_params any_map(void)
{
    struct motor_params p = bench_thor;
    p.sat_s = any_between(0, 8);
    p.sat_t = any_between(0, 8);
    p.sat_u = any_between(0, 8);
    p.sat_v = any_between(0, 8);
    p.sat_w = any_between(0, 1) ? 4 : 2;
    p.sat_a_bp = any_between(0, 3) ? any_real(0, 30) : 0;
    p.sat_i_f_a = any_between(0, 1) ? any_real(0, 2) : 0;
    return p;
}

/* Round trip through the flux linkage; the derivatives that solve for it are right only if it converges so far. */
static void inversion(void)
{
    for (size_t n = 0; n < 3; n++) {
        double error_a = 0;
        char name[100];
        for (int k = 0; k < 500; k++) {
            double i_a = any_real(0, 2 * machines[n].i_max_a), angle = any_real(-PI, PI), got_d, got_q;
            struct motor m = machine_at(machines[n].p, i_a * cos(angle), i_a * sin(angle));
            published_current(machines[n].p, m.psi_vs.d, m.psi_vs.q, &got_d, &got_q);
            error_a = fmax(error_a, hypot(got_d - i_a * cos(angle), got_q - i_a * sin(angle)));
        }
        snprintf(name, sizeof name, "%s: flux linkage of 500 currents, put into the published equations (A)",
                 machines[n].name);
        check_near(name, error_a, 0, 1e-9);
    }
}

static void any_exponents(void)
{
    double current_a = 0, slope = 0, asymmetry = 0, energy = 0;
    for (int n = 0; n < 1000; n++) {
        struct motor_params p = any_map();
        struct motor_map map;
        motor_map_init(&map, &p);
        const double h = 1e-6;
        double d = any_real(-0.4, 0.4), q = any_real(-0.4, 0.4), i_d, i_q, d1, q1, d0, q0, dq1, qd1, dq0, qd0;
        struct dq psi = {d, q}, i = motor_map_current(&map, psi);
        struct slopes g = motor_map_slopes(&map, psi);
        published_current(&p, d, q, &i_d, &i_q);
        published_current(&p, d + h, q, &d1, &qd1);
        published_current(&p, d - h, q, &d0, &qd0);
        published_current(&p, d, q + h, &dq1, &q1);
        published_current(&p, d, q - h, &dq0, &q0);
        double scale = fabs(g.dd) + fabs(g.qq);
        current_a = fmax(current_a, hypot(i.d - i_d, i.q - i_q) / (1 + hypot(i_d, i_q)));
        slope = fmax(slope, fabs(g.dd - (d1 - d0) / (2 * h)) / scale);
        slope = fmax(slope, fabs(g.qq - (q1 - q0) / (2 * h)) / scale);
        slope = fmax(slope, fabs(g.dq - (dq1 - dq0) / (2 * h)) / scale);
        asymmetry = fmax(asymmetry, fabs((dq1 - dq0) - (qd1 - qd0)) / (2 * h) / scale);
        double by_d = motor_map_energy(&map, (struct dq){d + h, q}) - motor_map_energy(&map, (struct dq){d - h, q});
        double by_q = motor_map_energy(&map, (struct dq){d, q + h}) - motor_map_energy(&map, (struct dq){d, q - h});
        energy = fmax(energy, hypot(by_d / (2 * h) - 1.5 * i_d, by_q / (2 * h) - 1.5 * i_q) / (1 + hypot(i_d, i_q)));
    }
    check_near("1000 maps of all exponents: current as published (relative)", current_a, 0, 1e-12);
    check_near("1000 maps: slopes by differences (relative)", slope, 0, 1e-6);
    check_near("1000 maps: reciprocal (relative)", asymmetry, 0, 1e-6);
    check_near("1000 maps: the energy's gradient is 3/2 the current (relative)", energy, 0, 1e-6);
}

/* Around a closed path of the flux linkage, through both axes and both signs. */
static void closed_path(void)
{
    for (size_t n = 0; n < 3; n++) {
        struct motor_map map;
        double work_j = 0, turnover_j = 0, there_j = 0;
        const int steps = 20000;
        char name[100];
        motor_map_init(&map, machines[n].p);
        for (int k = 0; k < steps; k++) {
            double a = 2 * PI * (k + 0.5) / steps, da = 2 * PI / steps;
            struct dq psi = {0.1 + 0.3 * cos(a), 0.35 * sin(a)}, i = motor_map_current(&map, psi);
            double piece_j = 1.5 * (i.d * -0.3 * sin(a) + i.q * 0.35 * cos(a)) * da;
            work_j += piece_j;
            turnover_j += fabs(piece_j);
            there_j += k < steps / 4 ? piece_j : 0;
        }
        double stored_j = motor_map_energy(&map, (struct dq){0.1, 0.35}) - motor_map_energy(&map, (struct dq){0.4, 0});
        snprintf(name, sizeof name, "%s: a closed path yields no energy (of its turnover)", machines[n].name);
        check_near(name, work_j / turnover_j, 0, 1e-6);
        snprintf(name, sizeof name, "%s: a quarter of it yields the difference stored (J)", machines[n].name);
        check_near(name, there_j, stored_j, 1e-6 * turnover_j);
    }
}

/* ---- the saturated machine as a whole ---- */

/* The test's own Heun steps of 0.1 us on the published equations, against motor_step() through a map that saturates. */
static void locked_rise(const struct machine *at, double v, double t_s)
{
    const struct motor_params *p = at->p;
    struct motor m;
    motor_init(&m, p, &bench_no_load);
    double d = m.psi_vs.d, q = 0, dt_s = 1e-7, r = p->resistance_ohm, i_d, i_q, j_d, j_q;
    char name[100];
    for (int n = 0; n < (int)lround(t_s / dt_s); n++) {
        published_current(p, d, q, &i_d, &i_q);
        double mid_d = d + dt_s * (v * cos(2.0) - r * i_d), mid_q = q + dt_s * (v * sin(2.0) - r * i_q);
        published_current(p, mid_d, mid_q, &j_d, &j_q);
        d += dt_s * (v * cos(2.0) - r * (i_d + j_d) / 2);
        q += dt_s * (v * sin(2.0) - r * (i_q + j_q) / 2);
    }
    struct motor_source source = bench_vector(v, 2.0);
    motor_lock(&m, true);
    bench_run_motor(&m, &source, t_s);
    published_current(p, d, q, &i_d, &i_q);
    snprintf(name, sizeof name, "%s: currents of a locked rise into saturation (A)", at->name);
    check_near(name, hypot(m.i_d_a - i_d, m.i_q_a - i_q), 0, 1e-5 * hypot(i_d, i_q));
    snprintf(name, sizeof name, "%s: it did saturate (A)", at->name);
    check_between(name, hypot(i_d, i_q), at->i_max_a, 3 * at->i_max_a);
}

/* A to B with C open: nothing may flow in C while the map bends. */
static void open_phase(void)
{
    struct motor m = machine_at(&bench_thor, 0, 0);
    struct motor_source source = {.emf_v = {100, 0, 0}, .held = {false, false, true}};
    double i_a[3], worst_a = 0;
    motor_lock(&m, true);
    for (int n = 0; n < 50; n++) {
        bench_run_motor(&m, &source, 100e-6);
        motor_currents(&m, i_a);
        worst_a = fmax(worst_a, fabs(i_a[2]));
    }
    check_between("open phase: the others carry (A)", i_a[0], 20, 400);
    check_near("open phase: nothing in it (A)", worst_a, 0, 1e-9);
}

/* A wire that breaks at full current: its flux goes, along its own axis, and what stands across that stays. */
static void broken_wire(void)
{
    struct motor m = machine_at(&bench_thor, -20, 30);
    struct dq before = m.psi_vs;
    double i_a[3], c = cos(-2 * PI / 3), s = sin(-2 * PI / 3);
    motor_currents(&m, i_a);
    check_between("broken wire: it carried (A)", fabs(i_a[2]), 10, 40);
    motor_hold_phase(&m, 2);
    motor_currents(&m, i_a);
    check_near("broken wire: nothing is left (A)", i_a[2], 0, 1e-12);
    check_near("broken wire: flux linkage across its axis stays (Vs)",
               -(m.psi_vs.d - before.d) * s + (m.psi_vs.q - before.q) * c, 0, 1e-12);
}

static void refusals(void)
{
    struct motor_params p = bench_thor;
    check_true("THOR is accepted up to 60 A", motor_params_check(&p, &bench_no_load, 60) == NULL);
    double *const exponents[] = {&p.sat_s, &p.sat_t, &p.sat_u, &p.sat_v};
    for (int n = 0; n < 4; n++) {
        *exponents[n] += 0.5;
        check_true("an exponent that is not whole is refused", motor_params_check(&p, &bench_no_load, 60) != NULL);
        p = bench_thor;
    }
    p.sat_w = 3;
    check_true("W = 3 is refused", motor_params_check(&p, &bench_no_load, 60) != NULL);
    p = bench_thor;
    p.sat_a_dq = 1e6;
    check_true("cross-saturation that turns an inductance negative is refused",
               motor_params_check(&p, &bench_no_load, 60) != NULL);
    p = bench_thor;
    p.sat_a_q0 = 0;
    check_true("a map without a q axis is refused", motor_params_check(&p, &bench_no_load, 60) != NULL);
}

int main(void)
{
    published();
    inversion();
    any_exponents();
    closed_path();
    locked_rise(&machines[0], 25, 50e-3);
    locked_rise(&machines[1], 30, 50e-3);
    locked_rise(&machines[2], 100, 5e-3);
    open_phase();
    broken_wire();
    refusals();
    return check_end();
}
