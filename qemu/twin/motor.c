/* SPDX-License-Identifier: GPL-2.0-or-later */
/* State equations, in the rotor's dq frame, with the flux linkage psi as the state:
 *
 *   dpsi_d/dt  = v_d - R i_d + w_e psi_q
 *   dpsi_q/dt  = v_q - R i_q - w_e psi_d         i = i(psi, theta_e) and T: motor_field.h
 *   dtheta/dt  = w,  w_e = p w,  theta_e = p theta     w, and what the shaft does with T: shaft.h
 *   C dTemp/dt = losses of copper and iron - (Temp - ambient) / R_th,  R = R_25 (1 + alpha (Temp - 25))
 *
 * Source of the electrical part: P. C. Krause et al., "Analysis of Electric Machinery and Drive Systems", chapter on
 * permanent-magnet ac machines; P. Vas, "Sensorless Vector and Direct Torque Control", chapter 1. Iron loss is a torque
 * that drags at the rotor: (T_h sign(w) + T_e w) |psi|^2 / psi_f^2. A phase without current is a constraint: its terminal
 * takes the voltage that keeps di/dt zero. */
#define _GNU_SOURCE
#include "motor.h"

#include <string.h>

#include "shaft.h"
#include "turn.h"

#define SQRT3              1.7320508075688772
#define SHORT_STEP         0.01 /* of the longest step: an error per step below 1e-8 of the change */
#define FIELD_STEP_K       0.01 /* change of the magnets' temperature that the field follows at once */
#define IRON_AT_REST_RAD_S 1.0  /* below about this speed the hysteresis' drag fades out */

/* Electrical angle of the magnetic axes of A, B, C. */
static const double axis_cos[3] = {1.0, -0.5, -0.5};
static const double axis_sin[3] = {0.0, SQRT3 / 2, -SQRT3 / 2};

/* What stays constant within a step. */
struct step_constants {
    const struct motor *m;
    const struct motor_source *source;
    double resistance_ohm;
    double loop_ohm, loop_per_h; /* of shorted turns; 0 per henry: none */
    double iron_per_wb2;         /* 1 / psi_f^2 */
    int held_count;
    int held_phase;
    struct shaft_step shaft;
};

/* One derivative at work. */
struct instant {
    double s, c;
    double speed_e;
    struct field_point field;
    struct dq v;       /* of the terminals */
    struct dq i;       /* of the terminals: the field's and that of shorted turns */
    struct dq fault;   /* axis of the phase with shorted turns */
    struct dq slope;   /* dpsi/dt */
    double loop_slope; /* of the current in shorted turns */
};

static inline double dot(struct dq a, struct dq b)
{
    return a.d * b.d + a.q * b.q;
}

static inline struct dq plus(struct dq a, double factor, struct dq b)
{
    return (struct dq){a.d + factor * b.d, a.q + factor * b.q};
}

/* The magnetic axis of a phase as the rotor sees it. */
static inline struct dq phase_axis(int phase, double s, double c)
{
    return (struct dq){axis_cos[phase] * c + axis_sin[phase] * s, axis_sin[phase] * c - axis_cos[phase] * s};
}

static inline void to_phases(double alpha, double beta, double abc[3])
{
    abc[0] = alpha;
    abc[1] = -0.5 * alpha + SQRT3 / 2 * beta;
    abc[2] = -0.5 * alpha - SQRT3 / 2 * beta;
}

/* ---- the present state ---- */

static void field_now(const struct motor *m, struct field_point *at)
{
    motor_field_at(&m->field, m->psi_vs, m->sin_e, m->cos_e, at);
}

static void follow_flux(struct motor *m)
{
    struct field_point at;
    field_now(m, &at);
    m->i_d_a = at.i.d;
    m->i_q_a = at.i.q;
}

double motor_magnet_c(const struct motor *m)
{
    return m->p.ambient_c + m->p.magnet_share * (m->winding_c - m->p.ambient_c);
}

/* The magnets' flux follows their temperature; the flux linkage stays, so the currents change a little. */
static void follow_temperature(struct motor *m)
{
    double magnet_c = motor_magnet_c(m);
    if (m->p.magnet_tempco_per_k != 0 && fabs(magnet_c - m->field_c) > FIELD_STEP_K) {
        m->field_c = magnet_c;
        motor_map_magnet(&m->field.map, 1 + m->p.magnet_tempco_per_k * (magnet_c - REFERENCE_C));
        follow_flux(m);
    }
}

void motor_init(struct motor *m, const struct motor_params *p, const struct load_params *load)
{
    memset(m, 0, sizeof *m);
    m->p = *p;
    m->load = *load;
    m->theta_rad = p->initial_angle_rad;
    m->winding_c = p->ambient_c + p->winding_rise_k;
    m->field_c = REFERENCE_C;
    motor_field_init(&m->field, p);
    sincos(p->pole_pairs * m->theta_rad, &m->sin_e, &m->cos_e);
    follow_temperature(m);
    motor_set_current(m, 0, 0);
}

double motor_resistance_ohm(const struct motor *m)
{
    return m->p.resistance_ohm * (1.0 + m->p.copper_tempco_per_k * (m->winding_c - REFERENCE_C));
}

double motor_torque_nm(const struct motor *m)
{
    struct field_point at;
    field_now(m, &at);
    return at.torque_nm;
}

double motor_magnetic_energy_j(const struct motor *m)
{
    struct field_point at;
    field_now(m, &at);
    return motor_field_energy(&m->field, &at) + 0.5 * m->fault.loop_h * m->loop_a * m->loop_a;
}

double motor_min_inductance_h(const struct motor *m)
{
    const struct motor_field *f = &m->field;
    double varies = 1 + fabs(f->eps_6) + fabs(f->eps_12);
    if (f->map.linear) {
        return fmin(m->p.ld_h, m->p.lq_h) / varies;
    }
    struct field_point at;
    field_now(m, &at);
    return 1 / (varies * slopes_largest(motor_map_slopes(&f->map, at.own)));
}

/* What varies with the angle has to be resolved, too. */
static double longest_turn_rad(const struct motor *m)
{
    const struct motor_params *p = &m->p;
    double cogging = fmax(p->cogging_per_rev, fmax(p->cogging2_per_rev, p->cogging3_per_rev)) / p->pole_pairs;
    return 0.1 * fmin(1, 6 / fmax(m->field.highest_order, cogging));
}

double motor_max_step_s(const struct motor *m, double source_r_ohm)
{
    double by_l_over_r_s = 0.25 * motor_min_inductance_h(m) / (motor_resistance_ohm(m) + source_r_ohm);
    double by_angle_s = longest_turn_rad(m) / (fabs(m->speed_rad_s) * m->p.pole_pairs + 1.0);
    double by_loop_s = m->fault.present
                           ? 0.25 * m->fault.loop_h / winding_short_loop_ohm(&m->fault, motor_resistance_ohm(m))
                           : INFINITY;
    return fmin(fmin(by_l_over_r_s, by_angle_s), fmin(by_loop_s, shaft_max_step_s(m)));
}

/* Shorted turns draw fraction * loop_a beside the field's current of their phase; two thirds of it stand on its axis. */
static inline struct dq with_loop(const struct motor *m, struct dq i, struct dq fault, double loop_a)
{
    return plus(i, 2.0 / 3 * m->fault.fraction * loop_a, fault);
}

static struct dq terminal_dq(const struct motor *m)
{
    struct dq fault = phase_axis(m->fault.phase, m->sin_e, m->cos_e);
    return with_loop(m, (struct dq){m->i_d_a, m->i_q_a}, fault, m->loop_a);
}

void motor_currents(const struct motor *m, double i_a[3])
{
    double s = m->sin_e, c = m->cos_e;
    struct dq i = terminal_dq(m);
    to_phases(i.d * c - i.q * s, i.d * s + i.q * c, i_a);
}

void motor_square_currents(const struct motor *m, double square_a2s[3])
{
    double own = m->alpha2_a2s / 4 + 3 * m->beta2_a2s / 4, mixed = SQRT3 / 2 * m->alpha_beta_a2s;
    square_a2s[0] = m->alpha2_a2s;
    square_a2s[1] = own - mixed;
    square_a2s[2] = own + mixed;
}

bool motor_set_current(struct motor *m, double i_d_a, double i_q_a)
{
    struct field_point at;
    struct dq own;
    field_now(m, &at);
    if (!motor_map_flux(&m->field.map, (struct dq){i_d_a / at.permeance, i_q_a / at.permeance}, &own)) {
        return false;
    }
    m->psi_vs.d = own.d + (at.magnet.d - m->field.map.psi_f_vs);
    m->psi_vs.q = own.q + at.magnet.q;
    follow_flux(m);
    return true;
}

/* ---- phases without current ---- */

/* What a volt second along an axis adds to the current of the terminals: the field's G and the loop's 1/L. */
static inline struct slopes terminal_slopes(const struct motor *m, const struct field_point *at, struct dq fault,
                                            double loop_per_h)
{
    struct slopes g = motor_field_slopes(&m->field, at);
    double loop = 2.0 / 3 * m->fault.fraction * m->fault.fraction * loop_per_h;
    return (struct slopes){g.dd + loop * fault.d * fault.d, g.dq + loop * fault.d * fault.q,
                           g.qq + loop * fault.q * fault.q};
}

static inline double along(struct slopes g, struct dq axis)
{
    return g.dd * axis.d * axis.d + 2 * g.dq * axis.d * axis.q + g.qq * axis.q * axis.q;
}

static double loop_per_h(const struct motor *m)
{
    return m->fault.present ? 1 / m->fault.loop_h : 0;
}

/* A blow of flux on the winding. */
static void strike(struct motor *m, double volt_seconds, struct dq axis, struct dq fault)
{
    m->psi_vs = plus(m->psi_vs, volt_seconds, axis);
    m->loop_a += m->fault.fraction * loop_per_h(m) * volt_seconds * dot(axis, fault);
    follow_flux(m);
}

void motor_hold_phase(struct motor *m, int phase)
{
    struct dq axis = phase_axis(phase, m->sin_e, m->cos_e), fault = phase_axis(m->fault.phase, m->sin_e, m->cos_e);
    double before_a = INFINITY;
    for (int n = 0; n < 50; n++) { /* once, unless the map bends: then by Newton's method */
        double i_a = dot(terminal_dq(m), axis);
        if (i_a == 0 || fabs(i_a) >= before_a) {
            return;
        }
        struct field_point at;
        field_now(m, &at);
        strike(m, -i_a / along(terminal_slopes(m, &at, fault, loop_per_h(m)), axis), axis, fault);
        before_a = fabs(i_a);
    }
}

/* All terminals held: no current at all. */
static void hold_all(struct motor *m)
{
    struct dq fault = phase_axis(m->fault.phase, m->sin_e, m->cos_e);
    double before_a = INFINITY;
    for (int n = 0; n < 50; n++) {
        struct dq i = terminal_dq(m);
        double i_a = fabs(i.d) + fabs(i.q);
        if (i_a == 0 || i_a >= before_a) {
            return;
        }
        struct field_point at;
        field_now(m, &at);
        strike(m, -1, slopes_solve(terminal_slopes(m, &at, fault, loop_per_h(m)), i), fault);
        before_a = i_a;
    }
}

/* ---- derivative ---- */

/* di/dt of the terminals as the stator sees it, in the rotor's coordinates. */
static inline struct dq current_slope(const struct step_constants *k, const struct instant *at, struct slopes g)
{
    const struct field_point *f = &at->field;
    struct dq own = plus(at->slope, -at->speed_e, f->turn);
    double turn = f->permeance_turn * at->speed_e;
    struct dq slope = {g.dd * own.d + g.dq * own.q + turn * f->f.d - at->speed_e * f->i.q,
                       g.dq * own.d + g.qq * own.q + turn * f->f.q + at->speed_e * f->i.d};
    return with_loop(k->m, slope, at->fault, at->loop_slope);
}

static inline void add_voltage(const struct step_constants *k, struct instant *at, struct dq v)
{
    at->v = plus(at->v, 1, v);
    at->slope = plus(at->slope, 1, v);
    at->loop_slope += k->m->fault.fraction * k->loop_per_h * dot(v, at->fault);
}

/* Finds the voltage along the held phase's axis that keeps its current where it is, at zero. */
static void hold_one(const struct step_constants *k, struct instant *at)
{
    struct dq axis = phase_axis(k->held_phase, at->s, at->c);
    struct dq slope = current_slope(k, at, motor_field_slopes(&k->m->field, &at->field));
    double extra_v = -dot(slope, axis) / along(terminal_slopes(k->m, &at->field, at->fault, k->loop_per_h), axis);
    add_voltage(k, at, (struct dq){extra_v * axis.d, extra_v * axis.q});
}

/* No current can flow at all: the terminals show the EMF. */
static void hold_three(const struct step_constants *k, struct instant *at)
{
    add_voltage(k, at, (struct dq){-at->v.d, -at->v.q});
    struct dq slope = current_slope(k, at, motor_field_slopes(&k->m->field, &at->field));
    struct dq v = slopes_solve(terminal_slopes(k->m, &at->field, at->fault, k->loop_per_h), slope);
    add_voltage(k, at, (struct dq){-v.d, -v.q});
}

/* The terminals' voltages as the source gives them. */
static inline struct dq source_voltage(const struct motor_source *src, const struct instant *at)
{
    double i[3], v[3], s = at->s, c = at->c;
    to_phases(at->i.d * c - at->i.q * s, at->i.d * s + at->i.q * c, i);
    for (int n = 0; n < 3; n++) {
        v[n] = src->emf_v[n] - src->r_ohm[n][0] * i[0] - src->r_ohm[n][1] * i[1] - src->r_ohm[n][2] * i[2];
    }
    double alpha = (2 * v[0] - v[1] - v[2]) / 3;
    double beta = (v[1] - v[2]) / SQRT3;
    return (struct dq){alpha * c + beta * s, beta * c - alpha * s};
}

static void electrical(const struct step_constants *k, const double y[STATES], struct instant *at)
{
    const struct motor *m = k->m;
    struct dq psi = {y[PSI_D], y[PSI_Q]};
    turn_by(m->p.pole_pairs * (y[THETA] - k->shaft.theta_start_rad), m->sin_e, m->cos_e, &at->s, &at->c);
    motor_field_at(&m->field, psi, at->s, at->c, &at->field);
    at->speed_e = m->p.pole_pairs * y[SPEED];
    at->i = at->field.i;
    at->fault = (struct dq){0, 0};
    at->loop_slope = 0;
    if (k->loop_per_h != 0) {
        at->fault = phase_axis(m->fault.phase, at->s, at->c);
        at->i = with_loop(m, at->i, at->fault, y[LOOP]);
        at->loop_slope = -k->loop_ohm * k->loop_per_h * y[LOOP];
    }
    struct dq v = source_voltage(k->source, at);
    at->v = (struct dq){0, 0};
    at->slope = (struct dq){at->speed_e * psi.q - k->resistance_ohm * at->field.i.d,
                            -at->speed_e * psi.d - k->resistance_ohm * at->field.i.q};
    add_voltage(k, at, v);
    if (k->held_count == 1) {
        hold_one(k, at);
    } else if (k->held_count > 1) {
        hold_three(k, at);
    }
}

/* Drag of the iron at the present flux linkage. */
static inline double iron_nm(const struct step_constants *k, const double y[STATES])
{
    const struct motor_params *p = &k->m->p;
    if (p->iron_hysteresis_nm == 0 && p->iron_eddy_nms == 0) {
        return 0;
    }
    double w = y[SPEED], sign = w / sqrt(w * w + IRON_AT_REST_RAD_S * IRON_AT_REST_RAD_S);
    double strength = k->iron_per_wb2 * (y[PSI_D] * y[PSI_D] + y[PSI_Q] * y[PSI_Q]);
    return strength * (p->iron_hysteresis_nm * sign + p->iron_eddy_nms * w);
}

static void derivative(const struct step_constants *k, const double y[STATES], double dy[SLOPES])
{
    struct instant at;
    electrical(k, y, &at);
    double alpha_a = at.i.d * at.c - at.i.q * at.s, beta_a = at.i.d * at.s + at.i.q * at.c;
    double torque_nm = at.field.torque_nm;
    dy[PSI_D] = at.slope.d;
    dy[PSI_Q] = at.slope.q;
    dy[LOOP] = at.loop_slope;
    dy[VOLT_ALPHA] = at.v.d * at.c - at.v.q * at.s;
    dy[VOLT_BETA] = at.v.d * at.s + at.v.q * at.c;
    dy[TORQUE] = torque_nm;
    dy[ALPHA2] = alpha_a * alpha_a;
    dy[BETA2] = beta_a * beta_a;
    dy[ALPHA_BETA] = alpha_a * beta_a;
    dy[E_IN] = 1.5 * dot(at.v, at.i);
    dy[E_COPPER] = 1.5 * k->resistance_ohm * dot(at.field.i, at.field.i);
    dy[E_FAULT] = k->loop_ohm * y[LOOP] * y[LOOP];
    dy[E_AIRGAP] = torque_nm * y[SPEED];
    shaft_derivative(&k->shaft, y, torque_nm, iron_nm(k, y), dy);
}

/* ---- one step ---- */

static inline void add(double sum[STATES], const double y[STATES], double factor, const double slope[SLOPES])
{
    for (int n = 0; n < STATES; n++) {
        sum[n] = y[n] + factor * slope[n];
    }
}

/* Second order, for steps so short that the fourth would not show. */
static void midpoint(const struct step_constants *k, double y[SLOPES], double dt_s)
{
    double k1[SLOPES], k2[SLOPES], at[STATES];
    derivative(k, y, k1);
    add(at, y, 0.5 * dt_s, k1);
    derivative(k, at, k2);
    for (int n = 0; n < SLOPES; n++) {
        y[n] += dt_s * k2[n];
    }
}

static void runge_kutta(const struct step_constants *k, double y[SLOPES], double dt_s)
{
    double k1[SLOPES], k2[SLOPES], k3[SLOPES], k4[SLOPES], at[STATES];
    derivative(k, y, k1);
    add(at, y, 0.5 * dt_s, k1);
    derivative(k, at, k2);
    add(at, y, 0.5 * dt_s, k2);
    derivative(k, at, k3);
    add(at, y, dt_s, k3);
    derivative(k, at, k4);
    for (int n = 0; n < SLOPES; n++) {
        y[n] += dt_s / 6 * (k1[n] + 2 * (k2[n] + k3[n]) + k4[n]);
    }
}

static void begin(struct step_constants *k)
{
    const struct motor *m = k->m;
    double psi_f = m->field.map.cold_psi_f_vs;
    k->resistance_ohm = motor_resistance_ohm(m);
    k->iron_per_wb2 = psi_f > 0 ? 1 / (psi_f * psi_f) : 1;
    k->loop_per_h = loop_per_h(m);
    k->loop_ohm = m->fault.present ? winding_short_loop_ohm(&m->fault, k->resistance_ohm) : 0;
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

static void take_over(struct motor *m, const double y[SLOPES])
{
    if (y[THETA] != m->theta_rad) {
        sincos(m->p.pole_pairs * y[THETA], &m->sin_e, &m->cos_e);
    }
    m->psi_vs = (struct dq){y[PSI_D], y[PSI_Q]};
    m->loop_a = y[LOOP];
    m->speed_rad_s = y[SPEED];
    m->theta_rad = y[THETA];
    m->load_speed_rad_s = y[LOAD_SPEED];
    m->twist_rad = y[TWIST];
    m->volt_alpha_vs += y[VOLT_ALPHA];
    m->volt_beta_vs += y[VOLT_BETA];
    m->torque_nms += y[TORQUE];
    m->alpha2_a2s += y[ALPHA2];
    m->beta2_a2s += y[BETA2];
    m->alpha_beta_a2s += y[ALPHA_BETA];
    m->energy_in_j += y[E_IN];
    m->energy_copper_j += y[E_COPPER];
    m->energy_fault_j += y[E_FAULT];
    m->energy_airgap_j += y[E_AIRGAP];
    m->energy_iron_j += y[E_IRON];
    m->energy_friction_j += y[E_FRICTION];
    m->energy_load_j += y[E_LOAD];
    m->energy_driver_j += y[E_DRIVER];
    follow_flux(m);
}

static void note_peaks(struct motor *m)
{
    double i_a[3];
    motor_currents(m, i_a);
    for (int n = 0; n < 3; n++) {
        m->peak_a[n] = fmax(m->peak_a[n], fabs(i_a[n]));
    }
}

void motor_step(struct motor *m, const struct motor_source *source, double dt_s)
{
    struct step_constants k = {.m = m, .source = source};
    follow_temperature(m);
    begin(&k);
    if (k.held_count > 1) {
        hold_all(m);
    }
    shaft_begin(&k.shaft, m, motor_torque_nm(m));
    double y[SLOPES] = {m->psi_vs.d,  m->psi_vs.q,         m->loop_a,   m->speed_rad_s,
                        m->theta_rad, m->load_speed_rad_s, m->twist_rad};
    if (dt_s < SHORT_STEP * motor_max_step_s(m, largest(source->r_ohm))) {
        midpoint(&k, y, dt_s);
    } else {
        runge_kutta(&k, y, dt_s);
    }
    shaft_end(&k.shaft, y);
    take_over(m, y);
    if (k.held_count == 1) {
        motor_hold_phase(m, k.held_phase);
    } else if (k.held_count > 1) {
        hold_all(m);
    }
    note_peaks(m);
    /* Slow enough for Euler at these steps. */
    double heat_w =
        (y[E_COPPER] + y[E_FAULT] + y[E_IRON]) / dt_s - (m->winding_c - m->p.ambient_c) / m->p.thermal_resistance_k_w;
    m->winding_c += dt_s * heat_w / m->p.thermal_capacity_j_k;
}

void motor_star_voltages(const struct motor *m, const struct motor_source *source, double v_v[3])
{
    struct step_constants k = {.m = m, .source = source, .shaft.theta_start_rad = m->theta_rad};
    double y[STATES] = {m->psi_vs.d, m->psi_vs.q, m->loop_a, m->speed_rad_s, m->theta_rad};
    struct instant at;
    begin(&k);
    electrical(&k, y, &at);
    to_phases(at.v.d * at.c - at.v.q * at.s, at.v.d * at.s + at.v.q * at.c, v_v);
}

void motor_short_winding(struct motor *m, int phase, double fraction, double r_ohm)
{
    motor_mend_winding(m);
    double phase_h = m->field.map.linear ? fmin(m->p.ld_h, m->p.lq_h) : motor_min_inductance_h(m);
    m->fault = winding_short_at(phase, fraction, r_ohm, motor_resistance_ohm(m), phase_h);
}

void motor_mend_winding(struct motor *m)
{
    m->fault = (struct winding_short){.present = false};
    m->loop_a = 0;
}
