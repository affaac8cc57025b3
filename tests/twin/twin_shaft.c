/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The motor's mechanics and its warming, alone, against closed-form solutions. Where something starts or ends within a
 * step of 10 us, that is the tolerance. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

static struct motor coasting(double coulomb_nm, double viscous_nms, double speed_rad_s)
{
    struct motor m = bench_motor_at(0);
    m.p.friction_coulomb_nm = coulomb_nm;
    m.p.friction_viscous_nms = viscous_nms;
    m.speed_rad_s = speed_rad_s;
    return m;
}

static double time_to_rest(struct motor *m)
{
    double t_s = 0;
    while (m->speed_rad_s != 0 && t_s < 10) {
        bench_run_motor(m, &bench_open_terminals, 10e-6);
        t_s += 10e-6;
    }
    return t_s;
}

static void run_down(void)
{
    const double coulomb = 2e-3, viscous = 5e-5, inertia = bench_motor.inertia_kgm2, speed = 100;
    struct motor m = coasting(coulomb, 0, speed);
    check_near("run-down by Coulomb friction (s)", time_to_rest(&m), inertia * speed / coulomb, 20e-6);
    bench_run_motor(&m, &bench_open_terminals, 0.01);
    check_true("at rest it stays at rest", m.speed_rad_s == 0 && m.stuck);
    m = coasting(coulomb, viscous, -speed);
    check_near("run-down by both, backwards (s)", time_to_rest(&m),
               inertia / viscous * log(1 + viscous * speed / coulomb), 20e-6);
    m = coasting(0, viscous, speed);
    m.load = (struct load_params){.inertia_kgm2 = 4e-5, .viscous_nms = 5e-5};
    bench_run_motor(&m, &bench_open_terminals, 0.5);
    check_near("viscous run-down with a load's inertia and drag (rad/s)", m.speed_rad_s,
               speed * exp(-0.5 * 1e-4 / 5e-5), 1e-6 * speed);
}

static void stick_and_slip(void)
{
    struct motor m = coasting(2e-3, 0, 0);
    m.load_nm = 1.999e-3;
    bench_run_motor(&m, &bench_open_terminals, 0.05);
    check_true("a load below friction moves nothing", m.speed_rad_s == 0 && m.theta_rad == 0);
    m.load_nm = 2.5e-3;
    bench_run_motor(&m, &bench_open_terminals, 0.05);
    check_near("a load above it pulls backwards with the rest (rad/s)", m.speed_rad_s, -0.5e-3 / 1e-5 * 0.05, 1e-6);
    m.load_nm = -4e-3;
    bench_run_motor(&m, &bench_open_terminals, 0.1);
    /* backwards friction helps to brake: 6 mN m down to 0 in 4.1667 ms, then 2 mN m forwards */
    check_near("through zero: friction changes side (rad/s)", m.speed_rad_s, 2e-3 / 1e-5 * (0.1 - 2.5e-5 / 6e-3), 0.01);
}

static void shaft_in_a_vice(void)
{
    struct motor m = coasting(0, 0, 50);
    m.load_nm = 1;
    motor_lock(&m, true);
    bench_run_motor(&m, &bench_open_terminals, 0.01);
    check_true("locked: no motion whatever pulls", m.speed_rad_s == 0 && m.theta_rad == 0);
    motor_spin(&m, 30);
    bench_run_motor(&m, &bench_open_terminals, 0.1);
    check_near("spun: the speed is imposed (rad)", m.theta_rad, 3, 1e-9);
    motor_release(&m);
    m.load_nm = 0.1;
    bench_run_motor(&m, &bench_open_terminals, 0.001);
    check_near("released: the load acts (rad/s)", m.speed_rad_s, 30 - 0.1 / 1e-5 * 0.001, 1e-6);
}

/* Cogging holds the rotor at 0 like a spring of T N; small swings have the frequency sqrt(T N / J). */
static void cogging(void)
{
    struct motor_params p = bench_motor;
    struct motor m;
    p.initial_angle_rad = 0.004;
    p.cogging_nm = 5e-3;
    p.cogging_per_rev = 24;
    motor_init(&m, &p, &bench_no_load);
    const double w = sqrt(5e-3 * 24 / 1e-5), swing_rad = 0.004;
    double t_s = 0;
    while (m.theta_rad > 0 && t_s < 1) {
        bench_run_motor(&m, &bench_open_terminals, 1e-6);
        t_s += 1e-6;
    }
    /* a pendulum's quarter period: its amplitude, N * swing / 4, lengthens it by less than 0.1 % */
    check_near("cogging: quarter of a swing (s)", t_s, PI / 2 / w, 1e-3 * PI / 2 / w);
    check_near("cogging: largest speed (rad/s)", -m.speed_rad_s, swing_rad * w, 2e-3 * swing_rad * w);
}

static void thermal_rise(void)
{
    struct motor m = bench_motor_at(0);
    m.p.thermal_capacity_j_k = 0.1; /* a time constant of 0.2 s */
    const double i = 10, v = i * bench_motor.resistance_ohm;
    struct motor_source source = bench_vector(v, 0);
    motor_lock(&m, true);
    motor_set_current(&m, i, 0);
    bench_run_motor(&m, &source, 0.2);
    double heat_w = 1.5 * bench_motor.resistance_ohm * i * i, final_k = heat_w * 2;
    check_near("thermal: one time constant (K)", m.winding_c - 25, final_k * (1 - exp(-1)), 1e-3);
    bench_run_motor(&m, &source, 3);
    check_near("thermal: settled (K)", m.winding_c - 25, final_k, 1e-3);
    check_near("thermal: copper energy (J)", m.energy_copper_j, heat_w * 3.2, 1e-6 * heat_w);

    m.p.copper_tempco_per_k = 0.0039;
    m.winding_c = 125;
    check_near("resistance at 125 degrees (ohm)", motor_resistance_ohm(&m), 0.3 * 1.39, 1e-12);
    m.p.thermal_capacity_j_k = 1e6;
    bench_run_motor(&m, &source, 0.05);
    check_near("and its current (A)", m.i_d_a, v / (0.3 * 1.39), 1e-4);
}

int main(void)
{
    run_down();
    stick_and_slip();
    shaft_in_a_vice();
    cogging();
    thermal_rise();
    return check_end();
}
