/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What hangs on the shaft: the second mass behind a spring, and the kinds of load, against closed-form solutions. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

/* The two-mass bench of the 2.2 kW ABB motor: Saarakkala, Hinkkanen 2015, as reduced by motulator. */
static const struct load_params two_mass = {.inertia_kgm2 = 5e-3, .stiffness_nm_rad = 700};

static struct motor behind_spring(struct load_params load, double inertia_kgm2)
{
    struct motor_params p = bench_motor;
    struct motor m;
    p.inertia_kgm2 = inertia_kgm2;
    motor_init(&m, &p, &load);
    return m;
}

static void coast(struct motor *m, double duration_s)
{
    bench_run_motor(m, &bench_open_terminals, duration_s);
}

/* Frequency of the twist after a pluck, from the times of many zero crossings. */
static double ringing_hz(struct motor *m)
{
    const double dt_s = 10e-6;
    double first_s = -1, last_s = 0, before = m->twist_rad;
    int crossings = -1;
    for (int n = 1; n <= 50000; n++) {
        coast(m, dt_s);
        if (before < 0 && m->twist_rad >= 0) {
            last_s = n * dt_s - dt_s * m->twist_rad / (m->twist_rad - before);
            first_s = first_s < 0 ? last_s : first_s;
            crossings++;
        }
        before = m->twist_rad;
    }
    return crossings / (last_s - first_s);
}

static void resonance(void)
{
    struct motor m = behind_spring(two_mass, 5e-3);
    m.twist_rad = 1e-3;
    double free_hz = ringing_hz(&m);
    check_near("two masses: resonance (Hz)", free_hz, sqrt(700 * 2 / 5e-3) / (2 * PI), 1e-4);
    check_near("as published, 84 Hz", free_hz, 84, 0.5);
    check_near("two masses: nothing is lost (J)", motor_mechanical_energy_j(&m), 0.5 * 700 * 1e-6, 1e-9);
    check_near("two masses: momentum stays zero (N m s)", 5e-3 * (m.speed_rad_s + m.load_speed_rad_s), 0, 1e-12);
    m = behind_spring(two_mass, 5e-3);
    m.twist_rad = 1e-3;
    motor_lock(&m, true);
    double held_hz = ringing_hz(&m);
    check_near("motor held: antiresonance (Hz)", held_hz, sqrt(700 / 5e-3) / (2 * PI), 1e-4);
    check_near("as published, 59.6 Hz", held_hz, 59.6, 0.5);
    check_true("motor held: it does not move", m.speed_rad_s == 0 && m.theta_rad == 0);
}

/* With damping in the shaft the twist decays by D (1/J1 + 1/J2) / 2. */
static void damping(void)
{
    struct load_params l = two_mass;
    l.damping_nms = 0.05;
    struct motor m = behind_spring(l, 5e-3);
    m.twist_rad = 1e-3;
    double decay = l.damping_nms * 2 / 5e-3 / 2, w = sqrt(700 * 2 / 5e-3 - decay * decay), t_s = 0.05;
    coast(&m, t_s);
    double expected = 1e-3 * exp(-decay * t_s) * (cos(w * t_s) + decay / w * sin(w * t_s));
    check_near("damped shaft: twist after 50 ms (rad)", m.twist_rad, expected, 1e-9);
    coast(&m, 2);
    check_near("damped shaft: its heat (J)", m.energy_friction_j, 0.5 * 700 * 1e-6, 1e-9);
}

/* Load torque on the far mass: the twist settles where the spring carries it. */
static void carried_load(void)
{
    struct load_params l = two_mass;
    l.damping_nms = 2;
    struct motor m = behind_spring(l, 5e-3);
    motor_lock(&m, true);
    m.load_nm = 3;
    coast(&m, 1);
    check_near("load on the far mass: the spring carries it (rad)", m.twist_rad, 3.0 / 700, 1e-9);
    check_near("load on the far mass: at rest (rad/s)", m.load_speed_rad_s, 0, 1e-9);
    motor_release(&m);
    coast(&m, 1);
    check_near("released: both fall together (rad/s)", m.speed_rad_s, -300, 0.1);
    check_near("released: half of the load accelerates the motor (rad)", m.twist_rad, 1.5 / 700, 1e-6);
}

/* Somebody drives the load at a fixed speed; the motor hangs on the spring behind it. */
static void spun_load(void)
{
    struct load_params l = two_mass;
    l.damping_nms = 0.2;
    struct motor m = behind_spring(l, 5e-3);
    m.p.friction_viscous_nms = 0.01;
    motor_spin(&m, 100);
    coast(&m, 0.5);
    check_near("spun: the load's speed is imposed (rad/s)", m.load_speed_rad_s, 100, 0);
    check_near("spun: the spring drags the motor along (rad)", m.twist_rad, -1.0 / 700, 1e-5);
    check_near("spun: the driver's work is what friction took and the spring holds (J)",
               m.energy_driver_j + 0.5 * 2 * 5e-3 * 100 * 100, m.energy_friction_j + motor_mechanical_energy_j(&m),
               1e-6);
}

/* With a spring a million times stiffer than needed the two masses are one. */
static void stiff_is_rigid(void)
{
    struct load_params l = two_mass, rigid = {.inertia_kgm2 = 5e-3, .coulomb_nm = 0.3, .viscous_nms = 1e-3};
    l.stiffness_nm_rad = 7e6;
    l.damping_nms = 20;
    l.coulomb_nm = 0.3;
    l.viscous_nms = 1e-3;
    struct motor a = behind_spring(l, 5e-3), b = behind_spring(rigid, 5e-3);
    a.load_nm = b.load_nm = -1;
    coast(&a, 0.5);
    coast(&b, 0.5);
    check_near("a stiff shaft as the rigid one (rad/s)", a.speed_rad_s, b.speed_rad_s, 1e-4);
    double w_end = 0.7 / 1e-3; /* where the load's drag balances what is left of the torque */
    check_near("the rigid one in closed form (rad/s)", b.speed_rad_s, w_end * (1 - exp(-0.5 * 1e-3 / 10e-3)), 1e-6);
}

/* ---- kinds of load ---- */

static struct motor rigid_with(struct load_params load)
{
    struct motor m;
    motor_init(&m, &bench_motor, &load);
    return m;
}

/* J dw/dt = -k w^2 */
static void fan(void)
{
    const double j = bench_motor.inertia_kgm2, k = 2e-7;
    struct motor m = rigid_with((struct load_params){.fan_nms2 = k});
    m.speed_rad_s = 300;
    coast(&m, 0.5);
    check_near("fan: run-down (rad/s)", m.speed_rad_s, 300 / (1 + k * 300 * 0.5 / j), 1e-6);
    m = rigid_with((struct load_params){.fan_nms2 = k});
    m.speed_rad_s = -300;
    coast(&m, 0.5);
    check_near("fan: backwards the same (rad/s)", m.speed_rad_s, -300 / (1 + k * 300 * 0.5 / j), 1e-6);
    check_near("fan: it has the energy (J)", m.energy_load_j, 0.5 * j * (90000 - m.speed_rad_s * m.speed_rad_s), 1e-9);
}

static void stiction(void)
{
    const double j = bench_motor.inertia_kgm2;
    struct load_params l = {.coulomb_nm = 4e-3, .stiction_nm = 10e-3, .stribeck_rad_s = 5};
    struct motor m = rigid_with(l);
    m.p.friction_coulomb_nm = 1e-3;
    m.load_nm = -10.9e-3;
    coast(&m, 0.1);
    check_true("stiction: below breakaway it stays", m.speed_rad_s == 0 && m.stuck);
    m.load_nm = -11.1e-3;
    coast(&m, 1e-5);
    check_true("stiction: above it starts", m.speed_rad_s > 0 && !m.stuck);
    coast(&m, 1);
    double before = m.speed_rad_s;
    coast(&m, 0.01);
    check_near("stiction: once fast, Coulomb's torque is left (N m)", (m.speed_rad_s - before) / 0.01 * j, 6.1e-3,
               1e-6);
    m.speed_rad_s = 5;
    m.load_nm = 0;
    coast(&m, 1e-5);
    check_near("Stribeck: half the difference at its speed (N m)", (5 - m.speed_rad_s) / 1e-5 * j, 8e-3, 1e-4);
    coast(&m, 0.2);
    check_true("Stribeck: comes to rest and stays", m.speed_rad_s == 0 && m.stuck);
}

/* Energy: friction on the far mass alone stops both, and all of the motion is in the friction. */
static void far_friction(void)
{
    struct load_params l = two_mass;
    l.coulomb_nm = 0.5;
    l.damping_nms = 0.2;
    struct motor m = behind_spring(l, 5e-3);
    m.speed_rad_s = m.load_speed_rad_s = 20;
    double start_j = motor_mechanical_energy_j(&m), t_s = 0;
    while ((!m.load_stuck || fabs(m.speed_rad_s) > 1e-6) && t_s < 5) {
        coast(&m, 1e-3);
        t_s += 1e-3;
    }
    check_true("friction on the load: it stands", m.load_stuck && m.load_speed_rad_s == 0);
    check_near("friction on the load: it has the energy (J)", m.energy_friction_j + motor_mechanical_energy_j(&m),
               start_j, 1e-4 * start_j);
    check_between("friction on the load: about J w / T (s)", t_s, 0.4, 1.5);
}

static void hoist(void)
{
    const double j = bench_motor.inertia_kgm2;
    struct motor m = rigid_with(bench_no_load);
    m.hoist_nm = 5e-3;
    coast(&m, 0.1);
    check_true("hoist: from rest it turns nothing", m.speed_rad_s == 0 && m.theta_rad == 0);
    m.load_nm = -4.9e-3;
    coast(&m, 0.01);
    check_true("hoist: less than its torque does not lift it", m.speed_rad_s == 0 && m.theta_rad == 0);
    m.load_nm = -7e-3;
    coast(&m, 0.05);
    check_near("hoist: more lifts it with the rest (rad/s)", m.speed_rad_s, 2e-3 / j * 0.05, 1e-6);
    m.load_nm = 0;
    coast(&m, 0.05);
    check_true("hoist: without drive it stops and is held", m.speed_rad_s == 0 && m.stuck);
    double lifted_j = m.energy_load_j;
    m.load_nm = 1.2e-3;
    coast(&m, 0.01);
    check_true("hoist: it is not let down by less than a quarter", m.speed_rad_s == 0 && m.stuck);
    m.load_nm = 1.3e-3;
    coast(&m, 0.01);
    check_near("hoist: lowered, it overhauls (rad/s)", m.speed_rad_s, -6.3e-3 / j * 0.01, 1e-6);
    check_true("hoist: it gives its energy back", m.energy_load_j < lifted_j);
    m = rigid_with(bench_no_load);
    m.hoist_nm = -5e-3;
    m.load_nm = 4.9e-3;
    coast(&m, 0.01);
    check_true("hoist that pulls forwards: less does not pull it back", m.speed_rad_s == 0 && m.theta_rad == 0);
    m.load_nm = -1.2e-3;
    coast(&m, 0.01);
    check_true("hoist that pulls forwards: nor is it by less than a quarter", m.speed_rad_s == 0 && m.stuck);
    m.load_nm = -1.3e-3;
    coast(&m, 0.01);
    check_near("hoist that pulls forwards: overhauls forwards (rad/s)", m.speed_rad_s, 6.3e-3 / j * 0.01, 1e-6);
}

static void refusals(void)
{
    struct load_params l = {.stiffness_nm_rad = 700};
    check_true("a spring without a mass behind it is refused", motor_params_check(&bench_motor, &l, 0) != NULL);
    check_true("two masses are not", motor_params_check(&bench_motor, &two_mass, 0) == NULL);
}

int main(void)
{
    resonance();
    damping();
    carried_load();
    spun_load();
    stiff_is_rigid();
    fan();
    stiction();
    far_friction();
    hoist();
    refusals();
    return check_end();
}
