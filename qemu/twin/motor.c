/* SPDX-License-Identifier: GPL-2.0-or-later */
/* State equations, in the rotor's dq frame:
 *
 *   Ld di_d/dt = v_d - R i_d + w_e Lq i_q
 *   Lq di_q/dt = v_q - R i_q - w_e (Ld i_d + psi)
 *   T          = 3/2 p (psi i_q + (Ld - Lq) i_d i_q)
 *   J dw/dt    = T - T_cogging(theta) - T_load - T_Coulomb sign(w) - B w
 *   dtheta/dt  = w,  w_e = p w,  theta_e = p theta
 *   C dTemp/dt = 3/2 R (i_d^2 + i_q^2) - (Temp - ambient) / R_th,  R = R_25 (1 + alpha (Temp - 25))
 *
 * Source of the electrical part: P. C. Krause et al., "Analysis of Electric Machinery and Drive Systems", chapter on
 * permanent-magnet ac machines; P. Vas, "Sensorless Vector and Direct Torque Control", chapter 1. Sinusoidal flux, no
 * saturation, no iron loss. A phase without current is a constraint: its terminal takes the voltage that keeps di/dt
 * zero. Coulomb friction holds a shaft at rest until the other torques exceed it. */
#define _GNU_SOURCE
#include "motor.h"

#include <string.h>

#define SQRT3       1.7320508075688772
#define SHORT_STEP  0.01 /* of the longest step: an error per step below 1e-8 of the change */
#define REFERENCE_C 25.0 /* temperature at which data sheets state the resistance */

/* Electrical angle of the magnetic axes of A, B, C. */
static const double axis_cos[3] = {1.0, -0.5, -0.5};
static const double axis_sin[3] = {0.0, SQRT3 / 2, -SQRT3 / 2};

#define KEY(field, lo, hi, init) \
    { \
#field, offsetof(struct motor_params, field), lo, hi, init \
    }
const struct config_key motor_keys[] = {
    KEY(pole_pairs, 1, 100, CONFIG_REQUIRED),
    KEY(resistance_ohm, 1e-4, 1e3, CONFIG_REQUIRED),
    KEY(ld_h, 1e-7, 10, CONFIG_REQUIRED),
    KEY(lq_h, 1e-7, 10, CONFIG_REQUIRED),
    KEY(flux_wb, 0, 10, CONFIG_REQUIRED),
    KEY(inertia_kgm2, 1e-10, 1e3, CONFIG_REQUIRED),
    KEY(friction_coulomb_nm, 0, 1e3, 0),
    KEY(friction_viscous_nms, 0, 1e3, 0),
    KEY(cogging_nm, 0, 1e3, 0),
    KEY(cogging_per_rev, 0, 1e4, 0),
    KEY(copper_tempco_per_k, 0, 0.1, 0.0039),
    KEY(thermal_resistance_k_w, 1e-3, 1e4, 5),
    KEY(thermal_capacity_j_k, 1e-2, 1e6, 50),
    KEY(ambient_c, -60, 200, REFERENCE_C),
    KEY(initial_angle_rad, -1e6, 1e6, 0),
    CONFIG_KEYS_END,
};
#undef KEY
#define KEY(field, lo, hi, init) \
    { \
#field, offsetof(struct load_params, field), lo, hi, init \
    }
const struct config_key load_keys[] = {
    KEY(inertia_kgm2, 0, 1e3, 0),
    KEY(viscous_nms, 0, 1e3, 0),
    CONFIG_KEYS_END,
};
#undef KEY

/* What Runge-Kutta integrates: the first four are states, the rest only accumulate. */
enum { I_D, I_Q, SPEED, THETA, VOLT_ALPHA, VOLT_BETA, E_IN, E_COPPER, E_AIRGAP, STATES };

/* What stays constant within a step. */
struct step_constants {
    const struct motor *m;
    const struct motor_source *source;
    double resistance_ohm;
    double total_inertia_kgm2;
    double total_viscous_nms;
    double direction;  /* sign of the Coulomb torque; 0 when the shaft does not move by itself */
    double cogging_nm; /* of the start: its angle moves little in a step */
    double cos_start, sin_start, theta_start_rad;
    int held_count;
    int held_phase;
    bool shaft_free;
};

void motor_init(struct motor *m, const struct motor_params *p, const struct load_params *load)
{
    memset(m, 0, sizeof *m);
    m->p = *p;
    m->load = *load;
    m->theta_rad = p->initial_angle_rad;
    m->winding_c = p->ambient_c;
    sincos(p->pole_pairs * m->theta_rad, &m->sin_e, &m->cos_e);
}

double motor_resistance_ohm(const struct motor *m)
{
    return m->p.resistance_ohm * (1.0 + m->p.copper_tempco_per_k * (m->winding_c - REFERENCE_C));
}

double motor_torque_nm(const struct motor *m)
{
    const struct motor_params *p = &m->p;
    return 1.5 * p->pole_pairs * (p->flux_wb + (p->ld_h - p->lq_h) * m->i_d_a) * m->i_q_a;
}

double motor_magnetic_energy_j(const struct motor *m)
{
    return 0.75 * (m->p.ld_h * m->i_d_a * m->i_d_a + m->p.lq_h * m->i_q_a * m->i_q_a);
}

double motor_max_step_s(const struct motor *m, double source_r_ohm)
{
    double inductance_h = fmin(m->p.ld_h, m->p.lq_h);
    double by_l_over_r_s = 0.25 * inductance_h / (motor_resistance_ohm(m) + source_r_ohm);
    double by_angle_s = 0.1 / (fabs(m->speed_rad_s) * m->p.pole_pairs + 1.0);
    return fmin(by_l_over_r_s, by_angle_s);
}

static void to_phases(double alpha, double beta, double abc[3])
{
    abc[0] = alpha;
    abc[1] = -0.5 * alpha + SQRT3 / 2 * beta;
    abc[2] = -0.5 * alpha - SQRT3 / 2 * beta;
}

void motor_currents(const struct motor *m, double i_a[3])
{
    double s = m->sin_e, c = m->cos_e;
    to_phases(m->i_d_a * c - m->i_q_a * s, m->i_d_a * s + m->i_q_a * c, i_a);
}

void motor_hold_phase(struct motor *m, int phase)
{
    double s = m->sin_e, c = m->cos_e;
    double axis_d = axis_cos[phase] * c + axis_sin[phase] * s;
    double axis_q = axis_sin[phase] * c - axis_cos[phase] * s;
    double i_phase_a = m->i_d_a * axis_d + m->i_q_a * axis_q;
    m->i_d_a -= i_phase_a * axis_d;
    m->i_q_a -= i_phase_a * axis_q;
}

static double cogging_nm(const struct motor_params *p, double theta_rad)
{
    return p->cogging_nm == 0 ? 0 : p->cogging_nm * sin(p->cogging_per_rev * theta_rad);
}

/* Sine and cosine of the electrical angle within a step: motor_max_step_s() keeps the turn since the start below 0.1,
 * where these series are exact to double precision. */
static inline void turn_from_start(const struct step_constants *k, double theta_rad, double *s, double *c)
{
    double x = k->m->p.pole_pairs * (theta_rad - k->theta_start_rad), xx = x * x;
    double sin_x = x * (1 - xx / 6 * (1 - xx / 20 * (1 - xx / 42 * (1 - xx / 72))));
    double cos_x = 1 - xx / 2 * (1 - xx / 12 * (1 - xx / 30 * (1 - xx / 56 * (1 - xx / 90))));
    *s = k->sin_start * cos_x + k->cos_start * sin_x;
    *c = k->cos_start * cos_x - k->sin_start * sin_x;
}

static void derivative(const struct step_constants *k, const double y[STATES], double dy[STATES])
{
    const struct motor_params *p = &k->m->p;
    const struct motor_source *src = k->source;
    double s, c, i[3], v[3];
    turn_from_start(k, y[THETA], &s, &c);
    to_phases(y[I_D] * c - y[I_Q] * s, y[I_D] * s + y[I_Q] * c, i);
    for (int n = 0; n < 3; n++) {
        v[n] = src->emf_v[n] - src->r_ohm[n][0] * i[0] - src->r_ohm[n][1] * i[1] - src->r_ohm[n][2] * i[2];
    }
    double alpha = (2 * v[0] - v[1] - v[2]) / 3;
    double beta = (v[1] - v[2]) / SQRT3;
    double v_d = alpha * c + beta * s;
    double v_q = beta * c - alpha * s;
    double w_e = p->pole_pairs * y[SPEED];
    double slope_d = (v_d - k->resistance_ohm * y[I_D] + w_e * p->lq_h * y[I_Q]) / p->ld_h;
    double slope_q = (v_q - k->resistance_ohm * y[I_Q] - w_e * (p->ld_h * y[I_D] + p->flux_wb)) / p->lq_h;

    if (k->held_count == 1) {
        /* Find the voltage along the held phase's axis that keeps its current where it is, at zero. */
        double axis_d = axis_cos[k->held_phase] * c + axis_sin[k->held_phase] * s;
        double axis_q = axis_sin[k->held_phase] * c - axis_cos[k->held_phase] * s;
        double slope = slope_d * axis_d + slope_q * axis_q + w_e * (y[I_D] * axis_q - y[I_Q] * axis_d);
        double extra = -slope / (axis_d * axis_d / p->ld_h + axis_q * axis_q / p->lq_h);
        slope_d += extra * axis_d / p->ld_h;
        slope_q += extra * axis_q / p->lq_h;
        v_d += extra * axis_d;
        v_q += extra * axis_q;
        alpha += extra * axis_cos[k->held_phase];
        beta += extra * axis_sin[k->held_phase];
    } else if (k->held_count > 1) {
        /* No current can flow at all: the terminals show the EMF. */
        v_d = 0;
        v_q = w_e * p->flux_wb;
        alpha = -v_q * s;
        beta = v_q * c;
        slope_d = 0;
        slope_q = 0;
    }

    double torque = 1.5 * p->pole_pairs * (p->flux_wb + (p->ld_h - p->lq_h) * y[I_D]) * y[I_Q];
    double accelerating = torque - k->cogging_nm - k->m->load_nm - p->friction_coulomb_nm * k->direction -
                          k->total_viscous_nms * y[SPEED];
    dy[I_D] = slope_d;
    dy[I_Q] = slope_q;
    dy[SPEED] = k->shaft_free ? accelerating / k->total_inertia_kgm2 : 0;
    dy[THETA] = y[SPEED];
    dy[VOLT_ALPHA] = alpha;
    dy[VOLT_BETA] = beta;
    dy[E_IN] = 1.5 * (v_d * y[I_D] + v_q * y[I_Q]);
    dy[E_COPPER] = 1.5 * k->resistance_ohm * (y[I_D] * y[I_D] + y[I_Q] * y[I_Q]);
    dy[E_AIRGAP] = torque * y[SPEED];
}

static inline void add(double sum[STATES], const double y[STATES], double factor, const double slope[STATES])
{
    for (int n = 0; n < STATES; n++) {
        sum[n] = y[n] + factor * slope[n];
    }
}

/* Second order, for steps so short that the fourth would not show. */
static void midpoint(const struct step_constants *k, double y[STATES], double dt_s)
{
    double k1[STATES], k2[STATES], at[STATES];
    derivative(k, y, k1);
    add(at, y, 0.5 * dt_s, k1);
    derivative(k, at, k2);
    add(y, y, dt_s, k2);
}

static void runge_kutta(const struct step_constants *k, double y[STATES], double dt_s)
{
    double k1[STATES], k2[STATES], k3[STATES], k4[STATES], at[STATES];
    derivative(k, y, k1);
    add(at, y, 0.5 * dt_s, k1);
    derivative(k, at, k2);
    add(at, y, 0.5 * dt_s, k2);
    derivative(k, at, k3);
    add(at, y, dt_s, k3);
    derivative(k, at, k4);
    for (int n = 0; n < STATES; n++) {
        y[n] += dt_s / 6 * (k1[n] + 2 * (k2[n] + k3[n]) + k4[n]);
    }
}

/* The torque that friction has to hold when the shaft stands still. */
static double torque_at_rest_nm(const struct motor *m)
{
    return motor_torque_nm(m) - cogging_nm(&m->p, m->theta_rad) - m->load_nm;
}

/* Decides whether the shaft moves during the next step and which way friction then points. */
static double friction_direction(struct motor *m)
{
    if (m->shaft != SHAFT_FREE) {
        m->stuck = false;
        return 0;
    }
    if (m->speed_rad_s != 0) {
        m->stuck = false;
        return m->speed_rad_s > 0 ? 1 : -1;
    }
    double pull_nm = torque_at_rest_nm(m);
    m->stuck = fabs(pull_nm) <= m->p.friction_coulomb_nm;
    return m->stuck ? 0 : (pull_nm > 0 ? 1 : -1);
}

static void begin(struct step_constants *k)
{
    const struct motor *m = k->m;
    k->resistance_ohm = motor_resistance_ohm(m);
    k->total_inertia_kgm2 = m->p.inertia_kgm2 + m->load.inertia_kgm2;
    k->total_viscous_nms = m->p.friction_viscous_nms + m->load.viscous_nms;
    k->cogging_nm = cogging_nm(&m->p, m->theta_rad);
    k->theta_start_rad = m->theta_rad;
    k->cos_start = m->cos_e;
    k->sin_start = m->sin_e;
    k->held_count = 0;
    k->held_phase = 0;
    for (int n = 0; n < 3; n++) {
        if (k->source->held[n]) {
            k->held_count++;
            k->held_phase = n;
        }
    }
}

static double largest(const double r_ohm[3][3])
{
    return fmax(fmax(r_ohm[0][0], r_ohm[1][1]), r_ohm[2][2]);
}

void motor_step(struct motor *m, const struct motor_source *source, double dt_s)
{
    struct step_constants k = {.m = m, .source = source, .direction = friction_direction(m)};
    k.shaft_free = m->shaft == SHAFT_FREE && !m->stuck;
    begin(&k);
    double y[STATES] = {m->i_d_a, m->i_q_a, m->speed_rad_s, m->theta_rad};
    if (k.held_count > 1) {
        y[I_D] = 0;
        y[I_Q] = 0;
    }
    if (dt_s < SHORT_STEP * motor_max_step_s(m, largest(source->r_ohm))) {
        midpoint(&k, y, dt_s);
    } else {
        runge_kutta(&k, y, dt_s);
    }
    if (y[THETA] != m->theta_rad) {
        sincos(m->p.pole_pairs * y[THETA], &m->sin_e, &m->cos_e);
    }

    if (k.shaft_free && y[SPEED] * k.direction < 0) {
        y[SPEED] = 0; /* came to rest: whether it stays is decided before the next step */
    }
    m->i_d_a = y[I_D];
    m->i_q_a = y[I_Q];
    m->speed_rad_s = y[SPEED];
    m->theta_rad = y[THETA];
    m->volt_alpha_vs += y[VOLT_ALPHA];
    m->volt_beta_vs += y[VOLT_BETA];
    m->energy_in_j += y[E_IN];
    m->energy_copper_j += y[E_COPPER];
    m->energy_airgap_j += y[E_AIRGAP];
    if (k.held_count == 1) {
        motor_hold_phase(m, k.held_phase);
    }
    /* Slow enough for Euler at these steps. */
    double heat_w = y[E_COPPER] / dt_s - (m->winding_c - m->p.ambient_c) / m->p.thermal_resistance_k_w;
    m->winding_c += dt_s * heat_w / m->p.thermal_capacity_j_k;
}

void motor_star_voltages(const struct motor *m, const struct motor_source *source, double v_v[3])
{
    struct step_constants k = {.m = m, .source = source};
    double y[STATES] = {m->i_d_a, m->i_q_a, m->speed_rad_s, m->theta_rad};
    double dy[STATES];
    begin(&k);
    derivative(&k, y, dy);
    to_phases(dy[VOLT_ALPHA], dy[VOLT_BETA], v_v);
}

void motor_lock(struct motor *m, bool locked)
{
    m->shaft = locked ? SHAFT_LOCKED : SHAFT_FREE;
    if (locked) {
        m->speed_rad_s = 0;
    }
}

void motor_spin(struct motor *m, double speed_rad_s)
{
    m->shaft = SHAFT_SPUN;
    m->speed_rad_s = speed_rad_s;
}

void motor_release(struct motor *m)
{
    m->shaft = SHAFT_FREE;
}
