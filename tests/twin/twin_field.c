/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What varies with the rotor's angle, against closed forms: harmonics of the EMF from the phases' own flux linkages,
 * torque from virtual work at fixed phase currents, cogging from its potential. */
#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

static const double order[6] = {5, 7, 11, 13, 17, 19};
static const double share[6] = {0.06, -0.03, 0.02, 0.025, -0.01, 0.05};

static struct motor_params with_harmonics(void)
{
    struct motor_params p = bench_motor;
    p.emf_5 = share[0];
    p.emf_7 = share[1];
    p.emf_11 = share[2];
    p.emf_13 = share[3];
    p.emf_17 = share[4];
    p.emf_19 = share[5];
    return p;
}

static struct motor_params with_permeance(struct motor_params p)
{
    p.permeance_6 = 0.08;
    p.permeance_12 = -0.03;
    return p;
}

static struct motor at_angle(struct motor_params p, double electrical_rad)
{
    struct motor m;
    p.initial_angle_rad = electrical_rad / p.pole_pairs;
    motor_init(&m, &p, &bench_no_load);
    return m;
}

/* Flux linkage of phase k from the magnets: psi (cos x + sum of e_n/n cos n x), x = theta_e - 120 k degrees. */
static double magnet_flux(const struct motor_params *p, double theta_e, int k)
{
    double x = theta_e - 2 * PI / 3 * k, sum = cos(x);
    const double e[6] = {p->emf_5, p->emf_7, p->emf_11, p->emf_13, p->emf_17, p->emf_19};
    for (int n = 0; n < 6; n++) {
        sum += e[n] / order[n] * cos(order[n] * x);
    }
    return p->flux_wb * sum;
}

static double emf(const struct motor_params *p, double theta_e, double speed_e, int k)
{
    const double h = 1e-5;
    return speed_e * (magnet_flux(p, theta_e + h, k) - magnet_flux(p, theta_e - h, k)) / (2 * h);
}

/* ---- EMF ---- */

static double worst_emf_v(const struct motor_params *p)
{
    const double speed_rad_s = 150, w_e = 4 * speed_rad_s;
    struct motor m = at_angle(*p, 0.3);
    double error_v = 0, v[3];
    motor_spin(&m, speed_rad_s);
    for (int n = 1; n <= 200; n++) {
        bench_run_motor(&m, &bench_open_terminals, 50e-6);
        motor_star_voltages(&m, &bench_open_terminals, v);
        for (int k = 0; k < 3; k++) {
            error_v = fmax(error_v, fabs(v[k] - emf(p, 0.3 + w_e * 50e-6 * n, w_e, k)));
        }
    }
    check_near("no current while it turns (A)", fabs(m.i_d_a) + fabs(m.i_q_a), 0, 1e-12);
    return error_v;
}

static void emf_harmonics(void)
{
    struct motor_params p = with_harmonics();
    check_near("EMF with harmonics: worst of three phases (V)", worst_emf_v(&p), 0, 1e-5);
    p = with_permeance(p);
    check_near("and where the permeance varies (V)", worst_emf_v(&p), 0, 1e-5);
    p = bench_thor;
    p.emf_5 = 0.05;
    struct motor m = at_angle(p, 0.1), plain = at_angle(bench_thor, 0.1);
    double v[3], w[3];
    motor_spin(&m, 100);
    motor_spin(&plain, 100);
    motor_star_voltages(&m, &bench_open_terminals, v);
    motor_star_voltages(&plain, &bench_open_terminals, w);
    double psi_f = plain.psi_vs.d;
    check_near("saturated machine: its 5th of 5 % (V)", v[0] - w[0], -200 * psi_f * 0.05 * sin(5 * 0.1), 1e-9);
}

/* ---- torque by virtual work ---- */

/* Co-energy of the linear machine at fixed stator currents: 3/2 (i L i / 2e + i psi_m). The magnets' part is the sum of
 * current times flux linkage over the phases. */
static double coenergy(const struct motor_params *p, const double abc[3], double theta_e)
{
    double alpha = abc[0], beta = (abc[1] - abc[2]) / sqrt(3), c = cos(theta_e), s = sin(theta_e);
    double d = alpha * c + beta * s, q = beta * c - alpha * s, magnets = 0;
    double e = 1 + p->permeance_6 * cos(6 * theta_e) + p->permeance_12 * cos(12 * theta_e);
    for (int k = 0; k < 3; k++) {
        magnets += abc[k] * magnet_flux(p, theta_e, k);
    }
    return 0.75 * (p->ld_h * d * d + p->lq_h * q * q) / e + magnets;
}

static double worst_torque_nm(const struct motor_params *p, double *largest_ripple_nm)
{
    double error_nm = 0;
    *largest_ripple_nm = 0;
    for (int n = 0; n < 200; n++) {
        double theta_e = any_real(-PI, PI), i_d = any_real(-20, 20), i_q = any_real(-20, 20), abc[3];
        const double h = 1e-5;
        struct motor m = at_angle(*p, theta_e);
        motor_set_current(&m, i_d, i_q);
        motor_currents(&m, abc);
        double work_nm = p->pole_pairs * (coenergy(p, abc, theta_e + h) - coenergy(p, abc, theta_e - h)) / (2 * h);
        double plain_nm = 1.5 * p->pole_pairs * (p->flux_wb + (p->ld_h - p->lq_h) * i_d) * i_q;
        error_nm = fmax(error_nm, fabs(motor_torque_nm(&m) - work_nm));
        *largest_ripple_nm = fmax(*largest_ripple_nm, fabs(work_nm - plain_nm));
    }
    return error_nm;
}

static void torque(void)
{
    struct motor_params p = with_harmonics();
    double ripple_nm;
    check_near("torque with EMF harmonics against virtual work (N m)", worst_torque_nm(&p, &ripple_nm), 0, 1e-7);
    check_between("that is not the torque without (N m)", ripple_nm, 0.05, 0.5);
    p = with_permeance(bench_motor);
    check_near("torque with varying permeance against virtual work (N m)", worst_torque_nm(&p, &ripple_nm), 0, 1e-7);
    check_between("that is not the torque without (N m)", ripple_nm, 0.02, 1);
    p = with_permeance(with_harmonics());
    check_near("torque with both against virtual work (N m)", worst_torque_nm(&p, &ripple_nm), 0, 1e-7);
}

/* Currents forced through the varying inductance: with the rotor locked, 1/L is the plain one times e. */
static void inductance(void)
{
    struct motor_params p = with_permeance(bench_motor);
    double error = 0;
    for (int n = 0; n < 12; n++) {
        double theta_e = 2 * PI / 12 * n + 0.05, e = 1 + 0.08 * cos(6 * theta_e) - 0.03 * cos(12 * theta_e);
        struct motor m = at_angle(p, theta_e);
        struct motor_source source = bench_vector(6, theta_e);
        motor_lock(&m, true);
        bench_run_motor(&m, &source, 300e-6);
        double tau_s = p.ld_h / e / p.resistance_ohm;
        error = fmax(error, fabs(m.i_d_a - 6 / p.resistance_ohm * (1 - exp(-300e-6 / tau_s))));
    }
    check_near("R-L rise at 12 positions with their own inductance (A)", error, 0, 1e-5);
}

/* A turning machine on a voltage, with both: what went in is in copper, air gap and field. */
static void power_balance(const char *name, struct motor_params p, double v, bool c_open)
{
    struct motor m = at_angle(p, 0.2);
    double speed_rad_s = 60, turnover_j = 0, before_j = 0;
    motor_spin(&m, speed_rad_s);
    for (int n = 0; n < 20000; n++) {
        struct motor_source source = bench_vector(v, 0.2 + p.pole_pairs * speed_rad_s * n * 5e-6 + (n < 10000 ? 2 : 4));
        source.r_ohm[0][0] = source.r_ohm[1][1] = source.r_ohm[2][2] = p.resistance_ohm;
        source.held[2] = c_open;
        motor_step(&m, &source, 5e-6);
        turnover_j += fabs(m.energy_in_j - before_j);
        before_j = m.energy_in_j;
    }
    double lost_j = m.energy_in_j - m.energy_copper_j - m.energy_airgap_j - motor_magnetic_energy_j(&m);
    check_near(name, lost_j / turnover_j, 0, 1e-6);
}

static void balances(void)
{
    struct motor_params p = with_permeance(with_harmonics());
    power_balance("balance of power, linear with harmonics (of the turnover)", p, 4, false);
    power_balance("the same with phase C open (of the turnover)", p, 4, true);
    p = with_permeance(bench_thor);
    p.emf_5 = 0.05;
    p.emf_19 = 0.05;
    power_balance("balance of power, saturated with harmonics (of the turnover)", p, 40, false);
    power_balance("the same with phase C open (of the turnover)", p, 40, true);
    p.sat_w = 4;
    power_balance("balance of power, bridges of W = 4 (of the turnover)", p, 40, false);
}

/* ---- slots ---- */

/* The keys of one order. */
static double *slots_of(const struct motor_params *p, int n)
{
    double *const orders_of[SLOT_ORDERS] = {(double *)&p->slots6_xx, (double *)&p->slots12_xx, (double *)&p->slots18_xx,
                                            (double *)&p->slots36_xx};
    return orders_of[n];
}

static struct motor_params with_slots(struct motor_params p)
{
    static const double of_thor[SLOT_FORMS] = {-5.6, 0.16, 3, -2.7, -1.4, 0.66};
    for (int n = 0; n < SLOT_ORDERS; n++) {
        for (int f = 0; f < SLOT_FORMS; f++) {
            slots_of(&p, n)[f] = of_thor[f] * (n % 2 ? -0.5 : 1);
        }
    }
    return p;
}

/* The energy of the slots, written out; x is what current adds to the magnets' flux. */
static double slots_energy(const struct motor_params *p, double x, double q, double theta_e)
{
    static const double orders[SLOT_ORDERS] = {6, 12, 18, 36};
    double sum_j = 0;
    for (int n = 0; n < SLOT_ORDERS; n++) {
        const double *k = slots_of(p, n);
        sum_j += cos(orders[n] * theta_e) * (k[0] * x * x + k[1] * q * q + k[2] * x * q * q + k[3] * q * q * q * q);
        sum_j += sin(orders[n] * theta_e) * (k[4] * x * q + k[5] * q * q * q);
    }
    return sum_j;
}

/* At fixed flux linkages of the stator torque is minus the change of energy over the angle; the current its change over the
 * flux linkage. */
static void slots(void)
{
    const struct motor_params smooth = bench_thor, p = with_slots(bench_thor);
    double worst_nm = 0, worst_a = 0, largest_nm = 0;
    for (int n = 0; n < 200; n++) {
        double theta_e = any_real(-PI, PI), h = 1e-5;
        struct motor m = at_angle(p, theta_e), plain = at_angle(smooth, theta_e);
        if (!motor_set_current(&m, any_real(-22, 5), any_real(-22, 22))) {
            check_true("slots: a current is set", false);
        }
        plain.psi_vs = m.psi_vs;
        struct field_point at;
        motor_field_at(&plain.field, plain.psi_vs, m.sin_e, m.cos_e, &at);
        double x = m.psi_vs.d - plain.field.map.psi_f_vs, q = m.psi_vs.q;
        double by_d = (slots_energy(&p, x + h, q, theta_e) - slots_energy(&p, x - h, q, theta_e)) / (2 * h);
        double by_q = (slots_energy(&p, x, q + h, theta_e) - slots_energy(&p, x, q - h, theta_e)) / (2 * h);
        double turn = (slots_energy(&p, x, q, theta_e + h) - slots_energy(&p, x, q, theta_e - h)) / (2 * h);
        double vector_nm = 1.5 * p.pole_pairs * (m.psi_vs.d * m.i_q_a - m.psi_vs.q * m.i_d_a);
        worst_a = fmax(worst_a, hypot(m.i_d_a - at.i.d - by_d / 1.5, m.i_q_a - at.i.q - by_q / 1.5));
        worst_nm = fmax(worst_nm, fabs(motor_torque_nm(&m) - vector_nm + p.pole_pairs * turn));
        largest_nm = fmax(largest_nm, fabs(p.pole_pairs * turn));
    }
    check_near("slots: currents from their energy (A)", worst_a, 0, 1e-6);
    check_near("slots: torque from their energy (N m)", worst_nm, 0, 1e-6);
    check_between("slots: that counts (N m)", largest_nm, 1, 20);
    struct motor idle = at_angle(p, 0.3);
    check_near("slots: nothing without current (N m)", motor_torque_nm(&idle), 0, 1e-12);
    power_balance("balance of power with slots (of the turnover)", p, 40, false);
    power_balance("the same with phase C open (of the turnover)", p, 40, true);
}

struct seen {
    double flux_vs, drop_v;
};

/* Of phase C's winding: its flux linkage, and the drop of what the field takes of current there. */
static struct seen phase_c(const struct motor *m)
{
    double axis = 4 * m->theta_rad - 4 * PI / 3, c = cos(axis), s = sin(axis);
    return (struct seen){m->psi_vs.d * c - m->psi_vs.q * s, m->p.resistance_ohm * (m->i_d_a * c - m->i_q_a * s)};
}

/* A floating terminal shows the change of its own flux linkage. What it shows before a step has to be what the step then
 * does, also where the inductance varies, other phases carry current, and shorted turns of theirs lend it some. */
static void floating_terminal(bool shorted)
{
    struct motor_params p = with_permeance(with_harmonics());
    struct motor m = at_angle(p, 0.2);
    const double dt_s = 0.5e-6;
    double error_v = 0, v0[3], v1[3];
    motor_spin(&m, 150);
    if (shorted) {
        motor_short_winding(&m, 0, 0.4, 0.01);
    }
    for (int n = 0; n < 20000; n++) {
        struct motor_source source = {.emf_v = {4 * sin(600 * n * dt_s), 0, 0}, .held = {false, false, true}};
        struct seen before = phase_c(&m);
        motor_star_voltages(&m, &source, v0);
        motor_step(&m, &source, dt_s);
        motor_star_voltages(&m, &source, v1);
        struct seen after = phase_c(&m);
        double seen_v = (after.flux_vs - before.flux_vs) / dt_s + (before.drop_v + after.drop_v) / 2;
        error_v = fmax(error_v, fabs(seen_v - (v0[2] + v1[2]) / 2));
    }
    check_near(shorted ? "the same beside shorted turns (V)"
                       : "a floating terminal shows its flux linkage's change (V)",
               error_v, 0, 1e-4);
    check_between("while the others carry (A)", hypot(m.i_d_a, m.i_q_a), 0.5, 20);
}

/* ---- cogging ---- */

static double potential_j(const struct motor_params *p, double theta_rad)
{
    return -p->cogging_nm / p->cogging_per_rev * cos(p->cogging_per_rev * theta_rad + p->cogging_rad) -
           p->cogging2_nm / p->cogging2_per_rev * cos(p->cogging2_per_rev * theta_rad + p->cogging2_rad) -
           p->cogging3_nm / p->cogging3_per_rev * cos(p->cogging3_per_rev * theta_rad + p->cogging3_rad);
}

/* A coasting rotor exchanges energy with the potential of three cogging harmonics, over ten turns. */
static void cogging(void)
{
    struct motor_params p = bench_motor;
    p.cogging_nm = 8e-3;
    p.cogging_per_rev = 24;
    p.cogging_rad = 0.4;
    p.cogging2_nm = 3e-3;
    p.cogging2_per_rev = 7;
    p.cogging2_rad = -1;
    p.cogging3_nm = 5e-3;
    p.cogging3_per_rev = 72;
    p.cogging3_rad = 2;
    struct motor m;
    motor_init(&m, &p, &bench_no_load);
    m.speed_rad_s = 40;
    double start_j = potential_j(&p, 0) + 0.5 * p.inertia_kgm2 * 40 * 40, error_j = 0, lowest = 40, highest = 40;
    while (m.theta_rad < 20 * PI) {
        bench_run_motor(&m, &bench_open_terminals, 10e-6);
        double moving_j = 0.5 * p.inertia_kgm2 * m.speed_rad_s * m.speed_rad_s;
        error_j = fmax(error_j, fabs(potential_j(&p, m.theta_rad) + moving_j - start_j));
        error_j = fmax(error_j, fabs(motor_mechanical_energy_j(&m) - start_j));
        lowest = fmin(lowest, m.speed_rad_s);
        highest = fmax(highest, m.speed_rad_s);
    }
    check_near("three cogging harmonics: energy over ten turns (J)", error_j, 0, 1e-9);
    check_between("they do change the speed (rad/s)", highest - lowest, 2, 20);
    m.speed_rad_s = 0;
    double at = m.theta_rad, h = 1e-4;
    bench_run_motor(&m, &bench_open_terminals, 1e-6);
    check_near("cogging torque from rest is the potential's slope (N m)", m.speed_rad_s / 1e-6 * p.inertia_kgm2,
               -(potential_j(&p, at + h) - potential_j(&p, at - h)) / (2 * h), 1e-6);
}

int main(void)
{
    emf_harmonics();
    torque();
    inductance();
    balances();
    slots();
    floating_terminal(false);
    floating_terminal(true);
    cogging();
    return check_end();
}
