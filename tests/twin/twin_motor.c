/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The motor alone against closed-form solutions of textbook cases. The model integrates with an error per step of about
 * 1e-8 of the change; tolerances of 1e-6 of the final value leave room for the thousands of steps of a run. */
#include "motor.h"

#include <math.h>

#include "bench.h"
#include "check.h"

#define PI    3.141592653589793
#define SQRT3 1.7320508075688772

static const struct motor_source shorted = {0};

static double rise(double v, double r_ohm, double l_h, double t_s)
{
    return v / r_ohm * (1 - exp(-t_s * r_ohm / l_h));
}

/* ---- electrical ---- */

static void locked_rotor(void)
{
    const double v = 3, r_ohm = bench_motor.resistance_ohm, angle_rad = 0.7, lead_rad = 1.1;
    struct motor m = bench_motor_at(angle_rad);
    struct motor_source source = bench_vector(v, angle_rad + lead_rad);
    double error_a = 0;
    motor_lock(&m, true);
    for (int n = 1; n <= 50; n++) {
        bench_run_motor(&m, &source, 100e-6);
        error_a = fmax(error_a, fabs(m.i_d_a - rise(v * cos(lead_rad), r_ohm, bench_motor.ld_h, n * 100e-6)));
        error_a = fmax(error_a, fabs(m.i_q_a - rise(v * sin(lead_rad), r_ohm, bench_motor.lq_h, n * 100e-6)));
    }
    check_near("locked rotor: R-L rise of i_d and i_q, worst error (A)", error_a, 0, 10e-6);
    check_near("locked rotor: it does not turn (rad)", m.theta_rad, angle_rad / 4, 1e-12);

    double i_a[3];
    motor_currents(&m, i_a);
    check_near("phase currents sum to zero (A)", i_a[0] + i_a[1] + i_a[2], 0, 1e-12);
    double angle_of_i = angle_rad + atan2(m.i_q_a, m.i_d_a), size_a = hypot(m.i_d_a, m.i_q_a);
    check_near("phase A is the projection on 0 degrees (A)", i_a[0], size_a * cos(angle_of_i), 1e-9);
    check_near("phase B on 120 degrees (A)", i_a[1], size_a * cos(angle_of_i - 2 * PI / 3), 1e-9);
    check_near("phase C on 240 degrees (A)", i_a[2], size_a * cos(angle_of_i + 2 * PI / 3), 1e-9);
}

/* A to B with C open: R = 2 R, and the inductance of the axis at -30 degrees between d and q. */
static void two_terminals(void)
{
    const double v = 4, t_s = 0.5e-3;
    struct motor m = bench_motor_at(0);
    struct motor_source source = {.emf_v = {v, 0, 0}, .held = {false, false, true}};
    double i_a[3];
    motor_lock(&m, true);
    bench_run_motor(&m, &source, t_s);
    motor_currents(&m, i_a);
    double l_h = 2 * (0.75 * bench_motor.ld_h + 0.25 * bench_motor.lq_h);
    check_near("two terminals: current (A)", i_a[0], rise(v, 2 * bench_motor.resistance_ohm, l_h, t_s), 10e-6);
    check_near("two terminals: returns through B (A)", i_a[1], -i_a[0], 1e-12);
    check_near("two terminals: nothing in C (A)", i_a[2], 0, 1e-12);
}

/* Resistance of the source adds to the winding's. */
static void source_resistance(void)
{
    const double v = 4, r_source_ohm = 0.2, t_s = 0.8e-3;
    struct motor m = bench_motor_at(0);
    struct motor_source source = bench_vector(v, 0);
    for (int k = 0; k < 3; k++) {
        source.r_ohm[k][k] = r_source_ohm;
    }
    motor_lock(&m, true);
    bench_run_motor(&m, &source, t_s);
    check_near("source resistance in series (A)", m.i_d_a,
               rise(v, bench_motor.resistance_ohm + r_source_ohm, bench_motor.ld_h, t_s), 10e-6);
}

/* Setting the derivatives of the two voltage equations to zero at constant speed, terminals joined. */
static void spinning_short_circuit(double speed_rad_s)
{
    const struct motor_params *p = &bench_motor;
    double w_e = p->pole_pairs * speed_rad_s, r = p->resistance_ohm, d = r * r + w_e * w_e * p->ld_h * p->lq_h;
    double i_q = -w_e * p->flux_wb * r / d, i_d = -w_e * w_e * p->lq_h * p->flux_wb / d;
    struct motor m = bench_motor_at(0);
    motor_spin(&m, speed_rad_s);
    bench_run_motor(&m, &shorted, 40 * p->lq_h / r);
    check_near("spinning short circuit: i_d (A)", m.i_d_a, i_d, 1e-6 * fabs(i_d));
    check_near("spinning short circuit: i_q (A)", m.i_q_a, i_q, 1e-6 * fabs(i_d));
    check_true("spinning short circuit: it brakes", motor_torque_nm(&m) * speed_rad_s < 0);
}

static void no_load_emf(void)
{
    const double speed_rad_s = 150, w_e = 4 * speed_rad_s, peak_v = w_e * bench_motor.flux_wb;
    struct motor m = bench_motor_at(0.3);
    double error_v = 0, v[3];
    motor_spin(&m, speed_rad_s);
    for (int n = 1; n <= 200; n++) {
        bench_run_motor(&m, &bench_open_terminals, 50e-6);
        motor_star_voltages(&m, &bench_open_terminals, v);
        for (int k = 0; k < 3; k++) {
            /* the flux through phase k is psi cos(theta_e - 120 k degrees) */
            double emf_v = -peak_v * sin(0.3 + w_e * 50e-6 * n - 2 * PI / 3 * k);
            error_v = fmax(error_v, fabs(v[k] - emf_v));
        }
    }
    check_near("no-load EMF: worst of three phases (V)", error_v, 0, 1e-6);
    check_near("no-load EMF: no current (A)", fabs(m.i_d_a) + fabs(m.i_q_a), 0, 1e-12);
    check_near("no-load EMF: no torque (N m)", motor_torque_nm(&m), 0, 1e-12);
}

/* Faraday: what the terminals saw is what the resistance dropped plus the change of flux linkage, in stator
 * coordinates. The test knows neither dq derivatives nor rotational voltages. */
static void flux_linkage(const struct motor *m, double *alpha_vs, double *beta_vs)
{
    double theta_e = m->p.pole_pairs * m->theta_rad;
    double d = m->p.ld_h * m->i_d_a + m->p.flux_wb, q = m->p.lq_h * m->i_q_a;
    *alpha_vs = d * cos(theta_e) - q * sin(theta_e);
    *beta_vs = d * sin(theta_e) + q * cos(theta_e);
}

static void driven_run(void)
{
    const double dt_s = 1e-6, v = 8, w_rad_s = 2 * PI * 80;
    struct motor m = bench_motor_at(0.2);
    double start_alpha, start_beta, end_alpha, end_beta, drop_alpha = 0, drop_beta = 0, travelled_rad = 0,
                                                         impulse_nms = 0;
    double applied_alpha = 0, applied_beta = 0;
    flux_linkage(&m, &start_alpha, &start_beta);
    for (int n = 0; n < 100000; n++) {
        double i0_a[3], i1_a[3], speed0 = m.speed_rad_s, torque0 = motor_torque_nm(&m);
        double angle_rad = w_rad_s * n * dt_s;
        struct motor_source source = bench_vector(v, angle_rad);
        motor_currents(&m, i0_a);
        motor_step(&m, &source, dt_s);
        motor_currents(&m, i1_a);
        drop_alpha += bench_motor.resistance_ohm * (i0_a[0] + i1_a[0]) / 2 * dt_s;
        drop_beta += bench_motor.resistance_ohm * (i0_a[1] - i0_a[2] + i1_a[1] - i1_a[2]) / (2 * SQRT3) * dt_s;
        applied_alpha += v * cos(angle_rad) * dt_s;
        applied_beta += v * sin(angle_rad) * dt_s;
        travelled_rad += (speed0 + m.speed_rad_s) / 2 * dt_s;
        impulse_nms += (torque0 + motor_torque_nm(&m)) / 2 * dt_s;
    }
    flux_linkage(&m, &end_alpha, &end_beta);
    /* the test's own trapezoids leave 1e-8 Vs; a cross term left out leaves 1e-3 */
    check_near("driven run: flux linkage in alpha (Vs)", end_alpha - start_alpha + drop_alpha, applied_alpha, 1e-7);
    check_near("driven run: flux linkage in beta (Vs)", end_beta - start_beta + drop_beta, applied_beta, 1e-7);
    check_near("driven run: the voltage integrals of the trace, alpha (Vs)", m.volt_alpha_vs, applied_alpha, 1e-9);
    check_near("driven run: the voltage integrals of the trace, beta (Vs)", m.volt_beta_vs, applied_beta, 1e-9);
    /* a step that comes to standstill ends there, even if the shaft then goes on: up to 1 us of torque each time */
    check_near("driven run: J times speed is the impulse (N m s)", m.speed_rad_s * bench_motor.inertia_kgm2,
               impulse_nms, 1e-3 * fabs(impulse_nms));
    check_near("driven run: angle is the integral of speed (rad)", m.theta_rad - 0.05, travelled_rad, 1e-5);
    check_true("driven run: it did move", fabs(travelled_rad) > 0.5);
}

/* ---- torque ---- */

/* Virtual work: at fixed phase currents the torque is the change of magnetic co-energy with the mechanical angle. The
 * co-energy of the magnets alone does not depend on it. */
static double coenergy(double alpha_a, double beta_a, double theta_mech_rad)
{
    const struct motor_params *p = &bench_motor;
    double c = cos(p->pole_pairs * theta_mech_rad), s = sin(p->pole_pairs * theta_mech_rad);
    double d = alpha_a * c + beta_a * s, q = beta_a * c - alpha_a * s;
    return 1.5 * (p->ld_h * d * d / 2 + p->lq_h * q * q / 2 + p->flux_wb * d);
}

static void torque(void)
{
    double error_nm = 0;
    for (int n = 0; n < 100; n++) {
        struct motor m = bench_motor_at(any_real(-PI, PI));
        const double h = 1e-5;
        motor_set_current(&m, any_real(-20, 20), any_real(-20, 20));
        double c = cos(4 * m.theta_rad), s = sin(4 * m.theta_rad);
        double alpha = m.i_d_a * c - m.i_q_a * s, beta = m.i_d_a * s + m.i_q_a * c;
        double work = (coenergy(alpha, beta, m.theta_rad + h) - coenergy(alpha, beta, m.theta_rad - h)) / (2 * h);
        error_nm = fmax(error_nm, fabs(motor_torque_nm(&m) - work));
    }
    check_near("torque with saliency against virtual work, worst (N m)", error_nm, 0, 1e-7);
    struct motor m = bench_motor_at(0);
    motor_set_current(&m, 0, 10);
    check_near("torque of 10 A in q: 1.5 p psi i (N m)", motor_torque_nm(&m), 0.45, 1e-12);
    motor_set_current(&m, -5, 10);
    check_near("with -5 A in d the reluctance adds (N m)", motor_torque_nm(&m), 0.45 + 6 * -0.1e-3 * -50, 1e-12);
}

/* ---- the linear machine, integrated once more ---- */

struct linear {
    double i_d, i_q, speed, theta;
};

/* The equations in currents, as textbooks have them. */
static struct linear linear_slope(const struct motor_params *p, const struct linear *x, double alpha_v, double beta_v)
{
    double c = cos(p->pole_pairs * x->theta), s = sin(p->pole_pairs * x->theta), w_e = p->pole_pairs * x->speed;
    double v_d = alpha_v * c + beta_v * s, v_q = beta_v * c - alpha_v * s;
    double torque_nm = 1.5 * p->pole_pairs * (p->flux_wb + (p->ld_h - p->lq_h) * x->i_d) * x->i_q;
    double lost_nm = p->cogging_nm * sin(p->cogging_per_rev * x->theta) + p->friction_viscous_nms * x->speed;
    return (struct linear){
        .i_d = (v_d - p->resistance_ohm * x->i_d + w_e * p->lq_h * x->i_q) / p->ld_h,
        .i_q = (v_q - p->resistance_ohm * x->i_q - w_e * (p->ld_h * x->i_d + p->flux_wb)) / p->lq_h,
        .speed = (torque_nm - lost_nm) / p->inertia_kgm2,
        .theta = x->speed,
    };
}

/* Heun's method in steps of 50 ns; the voltages jump every 100 us. */
static void as_before(void)
{
    struct motor_params p = bench_motor;
    p.cogging_nm = 5e-3;
    p.cogging_per_rev = 24;
    p.friction_viscous_nms = 3e-5;
    struct motor m;
    struct linear x = {0};
    const double dt_s = 50e-9;
    motor_init(&m, &p, &bench_no_load);
    for (int n = 0; n < 300; n++) {
        double angle = 2e-4 * n * n + any_real(-0.5, 0.5), v = any_real(3, 8);
        struct motor_source source = bench_vector(v, angle);
        bench_run_motor(&m, &source, 100e-6);
        for (int k = 0; k < 2000; k++) {
            struct linear a = linear_slope(&p, &x, v * cos(angle), v * sin(angle));
            struct linear y = {x.i_d + dt_s * a.i_d, x.i_q + dt_s * a.i_q, x.speed + dt_s * a.speed,
                               x.theta + dt_s * a.theta};
            struct linear b = linear_slope(&p, &y, v * cos(angle), v * sin(angle));
            x.i_d += dt_s / 2 * (a.i_d + b.i_d);
            x.i_q += dt_s / 2 * (a.i_q + b.i_q);
            x.speed += dt_s / 2 * (a.speed + b.speed);
            x.theta += dt_s / 2 * (a.theta + b.theta);
        }
    }
    check_near("linear machine integrated in currents: i_d (A)", m.i_d_a, x.i_d, 1e-5);
    check_near("linear machine integrated in currents: i_q (A)", m.i_q_a, x.i_q, 1e-5);
    check_near("linear machine integrated in currents: speed (rad/s)", m.speed_rad_s, x.speed, 1e-4);
    check_near("linear machine integrated in currents: angle (rad)", m.theta_rad, x.theta, 1e-6);
    check_true("it did turn", fabs(x.theta) > 1);
}

int main(void)
{
    as_before();
    locked_rotor();
    two_terminals();
    source_resistance();
    spinning_short_circuit(200);
    spinning_short_circuit(-35);
    no_load_emf();
    driven_run();
    torque();
    return check_end();
}
