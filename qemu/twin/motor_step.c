/* SPDX-License-Identifier: GPL-2.0-or-later */
/* State equations, in the rotor's dq frame, with the flux linkage psi as the state:
 *
 *   dpsi_d/dt  = v_d - R i_d + w_e psi_q
 *   dpsi_q/dt  = v_q - R i_q - w_e psi_d               i = i(psi, theta_e), and T: motor_field.h
 *   dtheta/dt  = w,  w_e = p w,  theta_e = p theta     w, and what the shaft does with T: shaft.h
 *   C dTemp/dt = heat in - heat out, of the winding and of the housing,  R = R_25 (1 + alpha (Temp - 25))
 *
 * Source of the electrical part: P. C. Krause et al., "Analysis of Electric Machinery and Drive Systems", chapter on
 * permanent-magnet ac machines; P. Vas, "Sensorless Vector and Direct Torque Control", chapter 1. Iron loss is a torque
 * that drags at the rotor: (T_h sign(w) |w/w_h|^a + T_e w) (|psi / psi_f|^b + t |i_d|). A phase without current is a
 * constraint: its terminal takes the voltage that keeps di/dt zero. */
#define _GNU_SOURCE
#include "motor.h"

#include "extremes.h"
#include "shaft.h"
#include "turn.h"
#include "windings.h"

#define LONGEST_TURN_RAD   0.1  /* electrical, a step */
#define SHORT_STEP         0.03 /* of the longest step: an error per step below 1e-7 of the change */
#define SHORT_DETAIL       0.03 /* the same where only a small part of field or torque changes so fast */
#define IRON_AT_REST_RAD_S 1.0  /* below about this speed the hysteresis' drag fades out */

/* What stays constant within a step. */
struct step_constants {
    const struct motor *m;
    const struct motor_source *source;
    double emf_alpha_v, emf_beta_v; /* of the source, in the stator's two axes */
    double r_alpha_ohm, r_beta_ohm, r_mixed_ohm;
    double resistance_ohm;
    double loop_ohm;     /* of shorted turns */
    double iron_per_wb2; /* 1 / psi_f^2 */
    double hysteresis_nm;
    int held_count;
    int held_phase;
    struct shaft_step shaft;
};

/* One derivative at work. */
struct instant {
    double s, c;
    double speed_e;
    const struct field_point *field;
    struct field_point turned; /* there, unless it is where the step begins */
    struct dq v;               /* of the terminals */
    struct dq i;               /* of the terminals: the field's and that of shorted turns */
    struct dq fault;           /* axis of the phase with shorted turns */
    struct dq slope;           /* dpsi/dt */
    double loop_slope;         /* of the current in shorted turns */
};

/* ---- the longest step ---- */

struct limits {
    double winding_s, detail_s;
};

static struct limits limits_of(const struct motor *m, double source_r_ohm)
{
    double phase_ohm = motor_resistance_ohm(m), speed_e = fabs(m->speed_rad_s) * m->p.pole_pairs + 1.0;
    double by_l_over_r_s = 0.25 * m->min_inductance_h / (phase_ohm + source_r_ohm);
    double by_angle_s = LONGEST_TURN_RAD / speed_e, by_harmonics_s = m->longest_turn_rad / speed_e;
    struct limits l = {.winding_s = by_l_over_r_s < by_angle_s ? by_l_over_r_s : by_angle_s,
                       .detail_s = by_harmonics_s < m->longest_shaft_s ? by_harmonics_s : m->longest_shaft_s};
    if (m->fault.present) {
        l.detail_s = lesser(l.detail_s, 0.25 * m->fault.loop_h / winding_short_loop_ohm(&m->fault, phase_ohm));
    }
    return l;
}

double motor_max_step_s(const struct motor *m, double source_r_ohm)
{
    struct limits l = limits_of(m, source_r_ohm);
    return l.winding_s < l.detail_s ? l.winding_s : l.detail_s;
}

/* ---- derivative ---- */

/* di/dt of the terminals as the stator sees it, in the rotor's coordinates. */
static inline struct dq current_slope(const struct step_constants *k, const struct instant *at, struct slopes g)
{
    const struct field_point *f = at->field;
    struct dq own = plus(at->slope, -at->speed_e, f->turn);
    struct dq turn = motor_field_turn(&k->m->field, f);
    struct dq slope = {g.dd * own.d + g.dq * own.q + at->speed_e * (turn.d - f->i.q),
                       g.dq * own.d + g.qq * own.q + at->speed_e * (turn.q + f->i.d)};
    return with_loop(&k->m->fault, slope, at->fault, at->loop_slope);
}

static inline void add_voltage(const struct step_constants *k, struct instant *at, struct dq v)
{
    at->v = plus(at->v, 1, v);
    at->slope = plus(at->slope, 1, v);
    at->loop_slope += k->m->fault.fraction * k->m->fault.loop_per_h * dot(v, at->fault);
}

/* Finds the voltage along the held phase's axis that keeps its current where it is, at zero. */
static void hold_one(const struct step_constants *k, struct instant *at)
{
    struct dq axis = phase_axis(k->held_phase, at->s, at->c);
    struct dq slope = current_slope(k, at, motor_field_slopes(&k->m->field, at->field));
    double extra_v = -dot(slope, axis) / along(terminal_slopes(k->m, at->field, at->fault), axis);
    add_voltage(k, at, (struct dq){extra_v * axis.d, extra_v * axis.q});
}

/* No current can flow at all: the terminals show the EMF. */
static void hold_three(const struct step_constants *k, struct instant *at)
{
    add_voltage(k, at, (struct dq){-at->v.d, -at->v.q});
    struct dq slope = current_slope(k, at, motor_field_slopes(&k->m->field, at->field));
    struct dq v = slopes_solve(terminal_slopes(k->m, at->field, at->fault), slope);
    add_voltage(k, at, (struct dq){-v.d, -v.q});
}

/* The terminals' voltages as the source gives them. */
static inline struct dq source_voltage(const struct step_constants *k, const struct instant *at)
{
    double i_alpha = at->i.d * at->c - at->i.q * at->s, i_beta = at->i.d * at->s + at->i.q * at->c;
    double alpha = k->emf_alpha_v - k->r_alpha_ohm * i_alpha - k->r_mixed_ohm * i_beta;
    double beta = k->emf_beta_v - k->r_mixed_ohm * i_alpha - k->r_beta_ohm * i_beta;
    return (struct dq){alpha * at->c + beta * at->s, beta * at->c - alpha * at->s};
}

/* The field is known where the step begins. */
static inline void look(const struct motor *m, struct dq psi, double theta_rad, struct instant *at)
{
    if (psi.d == m->psi_vs.d && psi.q == m->psi_vs.q && theta_rad == m->theta_rad) {
        at->s = m->sin_e;
        at->c = m->cos_e;
        at->field = &m->at;
        return;
    }
    turn_by(m->p.pole_pairs * (theta_rad - m->theta_rad), m->sin_e, m->cos_e, &at->s, &at->c);
    motor_field_at(&m->field, psi, at->s, at->c, &at->turned);
    at->field = &at->turned;
}

static void electrical(const struct step_constants *k, const double y[STATES], struct instant *at)
{
    const struct motor *m = k->m;
    struct dq psi = {y[PSI_D], y[PSI_Q]};
    look(m, psi, y[THETA], at);
    at->speed_e = m->p.pole_pairs * y[SPEED];
    at->i = at->field->i;
    at->fault = (struct dq){0, 0};
    at->loop_slope = 0;
    if (m->fault.present) {
        at->fault = phase_axis(m->fault.phase, at->s, at->c);
        at->i = with_loop(&m->fault, at->i, at->fault, y[LOOP]);
        at->loop_slope = -k->loop_ohm * m->fault.loop_per_h * y[LOOP];
    }
    struct dq v = source_voltage(k, at);
    at->v = (struct dq){0, 0};
    at->slope = (struct dq){at->speed_e * psi.q - k->resistance_ohm * at->field->i.d,
                            -at->speed_e * psi.d - k->resistance_ohm * at->field->i.q};
    add_voltage(k, at, v);
    if (k->held_count == 1) {
        hold_one(k, at);
    } else if (k->held_count > 1) {
        hold_three(k, at);
    }
}

/* Drag of the iron at the present flux linkage. */
static inline double iron_nm(const struct step_constants *k, const double y[STATES], double i_d_a)
{
    const struct motor_params *p = &k->m->p;
    if (p->iron_hysteresis_nm == 0 && p->iron_eddy_nms == 0) {
        return 0;
    }
    double w = y[SPEED], sign = w / sqrt(w * w + IRON_AT_REST_RAD_S * IRON_AT_REST_RAD_S);
    double square = k->iron_per_wb2 * (y[PSI_D] * y[PSI_D] + y[PSI_Q] * y[PSI_Q]);
    double strength = p->iron_flux_power > 0 ? pow(square, p->iron_flux_power / 2) : square;
    strength += p->iron_teeth_per_a * fabs(i_d_a);
    return strength * (k->hysteresis_nm * sign + p->iron_eddy_nms * w);
}

static void derivative(const struct step_constants *k, const double y[STATES], double dy[SLOPES])
{
    struct instant at;
    electrical(k, y, &at);
    double torque_nm = at.field->torque_nm;
    dy[PSI_D] = at.slope.d;
    dy[PSI_Q] = at.slope.q;
    dy[LOOP] = at.loop_slope;
    dy[VOLT_ALPHA] = at.v.d * at.c - at.v.q * at.s;
    dy[VOLT_BETA] = at.v.d * at.s + at.v.q * at.c;
    dy[E_IN] = 1.5 * dot(at.v, at.i);
    dy[E_COPPER] = 1.5 * k->resistance_ohm * dot(at.field->i, at.field->i);
    dy[E_FAULT] = k->loop_ohm * y[LOOP] * y[LOOP];
    dy[E_AIRGAP] = torque_nm * y[SPEED];
    shaft_derivative(&k->shaft, y, torque_nm, iron_nm(k, y, at.field->i.d), dy);
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

static void begin_source(struct step_constants *k)
{
    const double *e = k->source->emf_v, (*r)[3] = k->source->r_ohm;
    double to_b = (r[0][1] + r[1][0]) / 2, to_c = (r[0][2] + r[2][0]) / 2, between = (r[1][2] + r[2][1]) / 2;
    double own = (r[1][1] + r[2][2]) / 2;
    k->emf_alpha_v = (2 * e[0] - e[1] - e[2]) / 3;
    k->emf_beta_v = (e[1] - e[2]) / SQRT3;
    k->r_alpha_ohm = (2 * r[0][0] - 2 * (to_b + to_c) + own + between) / 3;
    k->r_beta_ohm = own - between;
    k->r_mixed_ohm = (to_b - to_c - (r[1][1] - r[2][2]) / 2) / SQRT3;
}

static void begin(struct step_constants *k)
{
    const struct motor *m = k->m;
    double psi_f = m->field.map.cold_psi_f_vs;
    begin_source(k);
    k->resistance_ohm = motor_resistance_ohm(m);
    k->iron_per_wb2 = psi_f > 0 ? 1 / (psi_f * psi_f) : 1;
    k->hysteresis_nm = m->p.iron_hysteresis_nm;
    if (m->p.iron_hysteresis_power > 0) {
        k->hysteresis_nm *= pow(fabs(m->speed_rad_s) / m->p.iron_hysteresis_rad_s, m->p.iron_hysteresis_power);
    }
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
    double larger = r_ohm[0][0] > r_ohm[1][1] ? r_ohm[0][0] : r_ohm[1][1];
    return larger > r_ohm[2][2] ? larger : r_ohm[2][2];
}

static void take_over(struct motor *m, const double y[SLOPES])
{
    if (y[THETA] != m->theta_rad) {
        sincos(m->p.pole_pairs * y[THETA], &m->sin_e, &m->cos_e);
        shaft_turn(m, y[THETA]);
    }
    m->psi_vs = (struct dq){y[PSI_D], y[PSI_Q]};
    m->loop_a = y[LOOP];
    m->speed_rad_s = y[SPEED];
    m->load_speed_rad_s = y[LOAD_SPEED];
    m->twist_rad = y[TWIST];
    m->volt_alpha_vs += y[VOLT_ALPHA];
    m->volt_beta_vs += y[VOLT_BETA];
    m->energy_in_j += y[E_IN];
    m->energy_copper_j += y[E_COPPER];
    m->energy_fault_j += y[E_FAULT];
    m->energy_airgap_j += y[E_AIRGAP];
    m->energy_iron_j += y[E_IRON];
    m->energy_friction_j += y[E_FRICTION];
    m->energy_load_j += y[E_LOAD];
    m->energy_driver_j += y[E_DRIVER];
    motor_follow_flux(m);
}

void motor_step(struct motor *m, const struct motor_source *source, double dt_s)
{
    struct step_constants k;
    k.m = m;
    k.source = source;
    motor_follow_temperature(m);
    begin(&k);
    if (k.held_count > 1) {
        motor_hold_all(m);
    }
    shaft_begin(&k.shaft, m, m->torque_nm);
    double y[SLOPES];
    y[PSI_D] = m->psi_vs.d;
    y[PSI_Q] = m->psi_vs.q;
    y[LOOP] = m->loop_a;
    y[SPEED] = m->speed_rad_s;
    y[THETA] = m->theta_rad;
    y[LOAD_SPEED] = m->load_speed_rad_s;
    y[TWIST] = m->twist_rad;
    for (int n = STATES; n < SLOPES; n++) {
        y[n] = 0;
    }
    struct limits longest = limits_of(m, largest(source->r_ohm));
    if (dt_s < SHORT_STEP * longest.winding_s && dt_s < SHORT_DETAIL * longest.detail_s) {
        midpoint(&k, y, dt_s);
    } else {
        runge_kutta(&k, y, dt_s);
    }
    shaft_end(&k.shaft, y);
    take_over(m, y);
    if (k.held_count == 1) {
        motor_hold_phase(m, k.held_phase);
    } else if (k.held_count > 1) {
        motor_hold_all(m);
    }
    motor_warm(m, y[E_COPPER] + y[E_FAULT], y[E_IRON], dt_s);
}

void motor_star_voltages(const struct motor *m, const struct motor_source *source, double v_v[3])
{
    struct step_constants k = {.m = m, .source = source};
    double y[STATES] = {m->psi_vs.d, m->psi_vs.q, m->loop_a, m->speed_rad_s, m->theta_rad};
    struct instant at;
    begin(&k);
    electrical(&k, y, &at);
    to_phases(at.v, at.s, at.c, v_v);
}
