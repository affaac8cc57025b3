/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Iron loss, temperature and shorted turns, against closed forms; and the balance of energy with everything on. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

static const struct motor_source shorted = {0};

static struct motor machine(struct motor_params p)
{
    struct motor m;
    motor_init(&m, &p, &bench_no_load);
    return m;
}

/* ---- iron ---- */

/* Mean torque of whoever spins the shaft, over a stretch of time. */
static double driver_nm(struct motor *m, const struct motor_source *source, double speed_rad_s, double duration_s)
{
    motor_spin(m, speed_rad_s);
    double before_j = m->energy_driver_j;
    bench_run_motor(m, source, duration_s);
    return (m->energy_driver_j - before_j) / (speed_rad_s * duration_s);
}

static void iron_drag(void)
{
    struct motor_params p = bench_motor;
    p.iron_hysteresis_nm = 3e-3;
    p.iron_eddy_nms = 2e-5;
    struct motor m = machine(p);
    check_near("iron: drag at 300 rad/s (N m)", driver_nm(&m, &bench_open_terminals, 300, 0.1), 3e-3 + 2e-5 * 300,
               1e-7);
    check_near("iron: its power (J)", m.energy_iron_j, (3e-3 + 2e-5 * 300) * 300 * 0.1, 1e-6);
    m = machine(p);
    check_near("iron: backwards it drags the other way (N m)", driver_nm(&m, &bench_open_terminals, -300, 0.1),
               -3e-3 - 2e-5 * 300, 1e-7);
    /* three time constants of 1/2 s with eddy currents alone */
    p.iron_hysteresis_nm = 0;
    m = machine(p);
    m.speed_rad_s = 200;
    bench_run_motor(&m, &bench_open_terminals, 1.5);
    check_near("iron: run-down by eddy currents (rad/s)", m.speed_rad_s, 200 * exp(-1.5 * 2e-5 / 1e-5), 1e-6);
}

/* In the short circuit of a spinning machine the flux linkage all but vanishes, and the drag with it. */
static void iron_follows_flux(void)
{
    struct motor_params p = bench_motor;
    p.iron_eddy_nms = 2e-5;
    const double speed = 400, w_e = 4 * speed, r = p.resistance_ohm, d = r * r + w_e * w_e * p.ld_h * p.lq_h;
    double i_q = -w_e * p.flux_wb * r / d, i_d = -w_e * w_e * p.lq_h * p.flux_wb / d;
    double psi_d = p.flux_wb + p.ld_h * i_d, psi_q = p.lq_h * i_q;
    double strength = (psi_d * psi_d + psi_q * psi_q) / (p.flux_wb * p.flux_wb);
    struct motor m = machine(p);
    motor_spin(&m, speed);
    bench_run_motor(&m, &shorted, 0.1);
    double before_j = m.energy_iron_j;
    bench_run_motor(&m, &shorted, 0.1);
    check_near("iron: drag goes with the square of the flux linkage (N m)",
               (m.energy_iron_j - before_j) / (speed * 0.1), 2e-5 * speed * strength, 1e-8);
    check_between("iron: that is far from the magnets' flux", strength, 0.1, 0.5);
}

static void iron_heat(void)
{
    struct motor_params p = bench_motor;
    p.iron_eddy_nms = 2e-5;
    p.thermal_capacity_j_k = 0.05;
    struct motor m = machine(p);
    motor_spin(&m, 500);
    bench_run_motor(&m, &bench_open_terminals, 2);
    check_near("iron: its heat warms the machine (K)", m.winding_c - 25, 2 * 2e-5 * 500 * 500, 1e-3);
}

/* Hysteresis that grows with a power of the speed, and what i_d adds in the teeth. */
static void iron_over_speed_and_current(void)
{
    struct motor_params p = bench_motor;
    p.iron_hysteresis_nm = 3e-3;
    p.iron_hysteresis_power = 0.3;
    p.iron_hysteresis_rad_s = 300;
    p.iron_flux_power = 1.8;
    p.iron_teeth_per_a = 0.05;
    static const double speeds[] = {60, 300, 600};
    for (int n = 0; n < 3; n++) {
        struct motor m = machine(p);
        motor_spin(&m, speeds[n]);
        bench_run_motor(&m, &bench_open_terminals, 0.1);
        double drag_nm = m.energy_iron_j / (speeds[n] * 0.1);
        check_near("iron: hysteresis over speed (N m)", drag_nm, 3e-3 * pow(speeds[n] / 300, 0.3), 2e-6);
    }
    const double speed = 400, w_e = 4 * speed, r = p.resistance_ohm, d = r * r + w_e * w_e * p.ld_h * p.lq_h;
    double i_q = -w_e * p.flux_wb * r / d, i_d = -w_e * w_e * p.lq_h * p.flux_wb / d;
    double psi_d = p.flux_wb + p.ld_h * i_d, psi_q = p.lq_h * i_q;
    double strength = pow(hypot(psi_d, psi_q) / p.flux_wb, 1.8) + 0.05 * fabs(i_d);
    struct motor m = machine(p);
    motor_spin(&m, speed);
    bench_run_motor(&m, &shorted, 0.1);
    double before_j = m.energy_iron_j;
    bench_run_motor(&m, &shorted, 0.1);
    check_near("iron: the teeth of a shorted machine (N m)", (m.energy_iron_j - before_j) / (speed * 0.1),
               3e-3 * pow(speed / 300, 0.3) * strength, 1e-6);
}

/* ---- temperature ---- */

/* A heated winding in its housing: two nodes, in closed form, and magnets that follow the housing. */
static void two_nodes(void)
{
    struct motor_params p = bench_motor;
    p.copper_tempco_per_k = 0;
    p.thermal_resistance_k_w = 2;
    p.winding_resistance_k_w = 0.5;
    p.thermal_capacity_j_k = 11;
    p.winding_capacity_j_k = 1;
    p.magnet_share = 0.4;
    struct motor m = machine(p);
    struct motor_source source = bench_vector(10 * p.resistance_ohm, 0);
    motor_lock(&m, true);
    motor_set_current(&m, 10, 0);
    const double heat_w = 1.5 * p.resistance_ohm * 100, g_wh = 1 / 0.5, g_ha = 1 / 1.5, c_w = 1, c_h = 10;
    double winding_k = 0, housing_k = 0, dt_s = 1e-5;
    bench_run_motor(&m, &source, 1.5);
    for (long n = 0; n < 150000; n++) {
        double through_w = (winding_k - housing_k) * g_wh;
        winding_k += (heat_w - through_w) / c_w * dt_s;
        housing_k += (through_w - housing_k * g_ha) / c_h * dt_s;
    }
    check_near("two nodes: winding after 1.5 s (K)", m.winding_c - 25, winding_k, 2e-4 * winding_k);
    check_near("two nodes: housing (K)", m.housing_c - 25, housing_k, 2e-3 * housing_k);
    check_near("two nodes: magnets follow the housing (K)", motor_magnet_c(&m) - 25, 0.4 * housing_k * 2 / 1.5,
               2e-3 * housing_k);
    check_true("two nodes: the winding ran ahead", winding_k > 4 * housing_k);
    p.winding_rise_k = 40;
    m = machine(p);
    check_near("two nodes: a warm start is a settled one (degrees)", m.housing_c, 25 + 40 * 0.75, 1e-12);
}

static double open_circuit_flux(struct motor_params p)
{
    struct motor m = machine(p);
    double v[3];
    motor_spin(&m, 100);
    motor_star_voltages(&m, &bench_open_terminals, v);
    bench_run_motor(&m, &bench_open_terminals, 1e-4);
    check_near("no current flows on open terminals (A)", hypot(m.i_d_a, m.i_q_a), 0, 1e-9);
    return hypot(v[0], (v[1] - v[2]) / sqrt(3)) / (100 * p.pole_pairs);
}

/* Expected: the flux linkage without current where remanence is that of 100 degrees, found here by the map's equations. */
static double hot_share(const struct motor_params *p)
{
    double share = 1 - 1.1e-3 * 75, ends[2];
    for (int hot = 0; hot < 2 && p->sat_a_d0 > 0; hot++) {
        double psi_n = p->sat_psi_n_wb * (hot ? share : 1), i_f = p->sat_i_f_a * (hot ? share : 1), low = 0, high = 1;
        while (high - low > 1e-13) {
            double psi = (low + high) / 2, off = psi - psi_n,
                   g = p->sat_a_b * off * off / (1 + p->sat_a_bp * off * off);
            double i = psi * (p->sat_a_d0 + p->sat_a_dd * psi * psi) + g * off - i_f;
            *(i < 0 ? &low : &high) = psi;
        }
        ends[hot] = low;
    }
    return p->sat_a_d0 > 0 ? ends[1] / ends[0] : share;
}

static void hot_flux(struct motor_params p, const char *name)
{
    double cold_vs = open_circuit_flux(p);
    p.magnet_tempco_per_k = -1.1e-3;
    check_near("at 25 degrees the coefficient changes nothing (relative)", open_circuit_flux(p) / cold_vs, 1, 1e-12);
    p.ambient_c = 100;
    check_near(name, open_circuit_flux(p) / cold_vs, hot_share(&p), 1e-9);
}

static void magnets(void)
{
    struct motor_params p = bench_thor;
    hot_flux(bench_motor, "100 degrees: flux of the linear machine (relative)");
    hot_flux(bench_thor, "100 degrees: flux with iron bridges (relative)");
    p.sat_a_b = 0;
    p.sat_i_f_a = 4;
    hot_flux(p, "100 degrees: flux of a magnet in series with its gap (relative)");
}

/* A winding heated by its current; the magnets share 40 % of its rise, and torque falls with their flux. */
static void warming(void)
{
    struct motor_params p = bench_motor;
    p.thermal_capacity_j_k = 0.1;
    p.magnet_tempco_per_k = -2e-3;
    p.magnet_share = 0.4;
    p.winding_rise_k = 10;
    struct motor m = machine(p);
    check_near("the winding starts warmer by what was said (degrees)", m.winding_c, 35, 1e-12);
    check_near("and the magnets by their share (degrees)", motor_magnet_c(&m), 29, 1e-12);
    struct motor_source source = bench_vector(10 * p.resistance_ohm, PI / 2);
    motor_lock(&m, true);
    bench_run_motor(&m, &source, 3);
    double rise_k = 2 * 1.5 * p.resistance_ohm * 100;
    check_near("settled winding (degrees)", m.winding_c, 25 + rise_k, 0.01);
    check_near("settled torque of 10 A (N m)", motor_torque_nm(&m),
               6 * (7.5e-3 * (1 - 2e-3 * 0.4 * rise_k) - 0.1e-3 * m.i_d_a) * 10, 1e-4);
}

/* ---- shorted turns ---- */

#define MU    0.2
#define R_S   0.05
#define PHASE bench_motor.resistance_ohm

/* DC from B and C to A: the phase is its healthy turns in series with the shorted ones beside R_s. */
static void shorted_dc(void)
{
    const double v = 1.5;
    double r_a = (1 - MU) * PHASE + MU * PHASE * R_S / (MU * PHASE + R_S);
    for (int k = 0; k < 3; k++) {
        struct motor m = machine(bench_motor);
        struct motor_source source = {0};
        double i_a[3];
        source.emf_v[k] = v;
        motor_lock(&m, true);
        motor_short_winding(&m, k, MU, R_S);
        bench_run_motor(&m, &source, 40e-3);
        motor_currents(&m, i_a);
        check_near("shorted turns: DC through their phase (A)", i_a[k], v / (r_a + PHASE / 2), 1e-6);
        double drop_v = i_a[k] * MU * PHASE * R_S / (MU * PHASE + R_S);
        check_near("shorted turns: the loop's current (A)", m.loop_a, drop_v / R_S, 1e-6);
        double before_j = m.energy_in_j, heat_j = m.energy_copper_j + m.energy_fault_j;
        bench_run_motor(&m, &source, 1e-3);
        check_near("shorted turns: all of the power is heat (J)", m.energy_copper_j + m.energy_fault_j - heat_j,
                   m.energy_in_j - before_j, 1e-9);
    }
}

/* Open terminals, shaft driven: the loop is the EMF of its turns on R_s and their own resistance and inductance. The test's
 * machine is not salient, so that one inductance does. */
static void shorted_spinning(void)
{
    struct motor_params p = bench_motor;
    p.lq_h = p.ld_h;
    struct motor m = machine(p);
    const double speed = 100, w = 4 * speed;
    motor_short_winding(&m, 1, MU, R_S);
    motor_spin(&m, speed);
    bench_run_motor(&m, &bench_open_terminals, 10e-3);
    double loop_h = m.fault.loop_h + 2.0 / 3 * MU * MU * p.ld_h, loop_ohm = R_S + MU * PHASE;
    double peak_a = MU * w * p.flux_wb / hypot(loop_ohm, w * loop_h), found_a = 0, worst_a = 0, i_a[3];
    double before_j = m.energy_driver_j, turn_s = 2 * PI / w;
    for (int n = 0; n < 1000; n++) {
        bench_run_motor(&m, &bench_open_terminals, turn_s / 1000);
        motor_currents(&m, i_a);
        found_a = fmax(found_a, fabs(m.loop_a));
        worst_a = fmax(worst_a, fabs(i_a[0]) + fabs(i_a[1]) + fabs(i_a[2]));
    }
    check_near("shorted turns, spinning: the loop's current (A)", found_a, peak_a, 1e-4 * peak_a);
    check_near("shorted turns, spinning: nothing at the terminals (A)", worst_a, 0, 1e-9);
    check_near("shorted turns, spinning: the drag heats the loop (J)", m.energy_driver_j - before_j,
               0.5 * loop_ohm * peak_a * peak_a * turn_s, 1e-3 * 0.5 * loop_ohm * peak_a * peak_a * turn_s);
    motor_mend_winding(&m);
    before_j = m.energy_driver_j;
    bench_run_motor(&m, &bench_open_terminals, 1e-3);
    check_near("mended: no drag is left (J)", m.energy_driver_j - before_j, 0, 1e-9);
}

/* ---- everything at once ---- */

static void everything(const char *name, struct motor_params p, double v, double stiffness_nm_rad)
{
    struct load_params l = {.inertia_kgm2 = p.inertia_kgm2,
                            .viscous_nms = 1e-5,
                            .stiffness_nm_rad = stiffness_nm_rad,
                            .damping_nms = stiffness_nm_rad * 1e-5,
                            .fan_nms2 = 1e-7,
                            .coulomb_nm = 3e-3,
                            .stiction_nm = 6e-3,
                            .stribeck_rad_s = 2};
    p.friction_coulomb_nm = 1e-3;
    p.friction_viscous_nms = 1e-5;
    p.emf_5 = 0.03;
    p.emf_11 = 0.01;
    p.emf_19 = 0.02;
    p.permeance_6 = 0.04;
    p.permeance_12 = 0.02;
    p.cogging_nm = 5e-3;
    p.cogging_per_rev = 24;
    p.cogging2_nm = 2e-3;
    p.cogging2_per_rev = 9;
    p.iron_hysteresis_nm = 2e-3;
    p.iron_eddy_nms = 1e-5;
    p.copper_tempco_per_k = 3.9e-3;
    p.magnet_tempco_per_k = -1.2e-3;
    p.magnet_share = 0.5;
    p.winding_rise_k = 20;
    struct motor m;
    motor_init(&m, &p, &l);
    double start_j = motor_mechanical_energy_j(&m) + motor_magnetic_energy_j(&m), turnover_j = 0, before_j = 0,
           furthest_rad = 0;
    for (int n = 0; n < 200000; n++) {
        double t_s = n * 2e-6, chirp = 2 * PI * 2 * (1 - cos(2 * PI * t_s / 0.4));
        struct motor_source source = bench_vector(v, chirp);
        source.r_ohm[0][0] = source.r_ohm[1][1] = source.r_ohm[2][2] = p.resistance_ohm / 2;
        m.hoist_nm = t_s > 0.1 ? 5e-3 : 0;
        if (n == 120000) {
            motor_short_winding(&m, 2, 0.1, 0.1);
        }
        motor_step(&m, &source, 2e-6);
        turnover_j += fabs(m.energy_in_j - before_j);
        before_j = m.energy_in_j;
        furthest_rad = fmax(furthest_rad, fabs(m.theta_rad));
    }
    double stored_j = motor_mechanical_energy_j(&m) + motor_magnetic_energy_j(&m) - start_j;
    double spent_j = m.energy_copper_j + m.energy_fault_j + m.energy_iron_j + m.energy_friction_j + m.energy_load_j;
    check_near(name, (m.energy_in_j + m.energy_driver_j - spent_j - stored_j) / turnover_j, 0, 1e-5);
    check_between("it did turn (rad)", furthest_rad, 3, 1000);
}

int main(void)
{
    iron_drag();
    iron_follows_flux();
    iron_heat();
    iron_over_speed_and_current();
    two_nodes();
    magnets();
    warming();
    shorted_dc();
    shorted_spinning();
    everything("everything on, linear, rigid: balance of energy (of the turnover)", bench_motor, 6, 0);
    everything("everything on, linear, two masses: balance of energy (of the turnover)", bench_motor, 6, 2);
    everything("everything on, THOR, two masses: balance of energy (of the turnover)", bench_thor, 40, 500);
    return check_end();
}
