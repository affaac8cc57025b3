/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The machine's state, and what can be read from it and done to it between two steps. */
#define _GNU_SOURCE
#include "motor.h"

#include <string.h>

#include "shaft.h"
#include "windings.h"

#define FIELD_STEP_K 0.01 /* change of the magnets' temperature that the field follows at once */

void motor_follow_flux(struct motor *m)
{
    const struct motor_field *f = &m->field;
    motor_field_at(f, m->psi_vs, m->sin_e, m->cos_e, &m->at);
    m->i_d_a = m->at.i.d;
    m->i_q_a = m->at.i.q;
    m->torque_nm = m->at.torque_nm;
    if (!f->map.linear || f->slots.present) {
        m->min_inductance_h = motor_field_least_h(f, &m->at);
    }
}

void motor_put_back(struct motor *m, const struct motor_state *s)
{
    memcpy(&m->psi_vs, s->bytes, sizeof s->bytes);
    motor_field_at(&m->field, m->psi_vs, m->sin_e, m->cos_e, &m->at);
}

static double housing_k_w(const struct motor *m)
{
    return m->p.thermal_resistance_k_w - m->p.winding_resistance_k_w;
}

/* Of the winding, had it kept pace with the housing: an overload of seconds warms no magnets. */
static double slow_rise_k(const struct motor *m)
{
    return (m->housing_c - m->p.ambient_c) * m->p.thermal_resistance_k_w / housing_k_w(m);
}

/* Slow enough for Euler at these steps. One node where winding and housing are one. */
void motor_warm(struct motor *m, double copper_j, double iron_j, double dt_s)
{
    const struct motor_params *p = &m->p;
    if (p->winding_capacity_j_k == 0) {
        double out_j = (m->winding_c - p->ambient_c) / p->thermal_resistance_k_w * dt_s;
        m->winding_c += (copper_j + iron_j - out_j) / p->thermal_capacity_j_k;
        m->housing_c = m->winding_c;
        return;
    }
    double to_ambient_j = (m->housing_c - p->ambient_c) / housing_k_w(m) * dt_s;
    double to_housing_j = (m->winding_c - m->housing_c) / p->winding_resistance_k_w * dt_s;
    m->winding_c += (copper_j - to_housing_j) / p->winding_capacity_j_k;
    m->housing_c += (iron_j + to_housing_j - to_ambient_j) / (p->thermal_capacity_j_k - p->winding_capacity_j_k);
}

double motor_magnet_c(const struct motor *m)
{
    return m->p.ambient_c + m->p.magnet_share * slow_rise_k(m);
}

void motor_follow_temperature(struct motor *m)
{
    double magnet_c = motor_magnet_c(m);
    if (m->p.magnet_tempco_per_k != 0 && fabs(magnet_c - m->field_c) > FIELD_STEP_K) {
        m->field_c = magnet_c;
        motor_map_magnet(&m->field.map, 1 + m->p.magnet_tempco_per_k * (magnet_c - REFERENCE_C));
        motor_follow_flux(m);
    }
}

/* What varies with the angle has to be resolved, too: 0.6 of its own radians a step. */
static double longest_turn_rad(const struct motor *m)
{
    const struct motor_params *p = &m->p;
    double cogging = fmax(p->cogging_per_rev, fmax(p->cogging2_per_rev, p->cogging3_per_rev)) / p->pole_pairs;
    return 0.6 / fmax(m->field.highest_order, cogging);
}

void motor_init(struct motor *m, const struct motor_params *p, const struct load_params *load)
{
    memset(m, 0, sizeof *m);
    m->p = *p;
    m->load = *load;
    m->theta_rad = p->initial_angle_rad;
    m->winding_c = p->ambient_c + p->winding_rise_k;
    m->housing_c = p->ambient_c + p->winding_rise_k * housing_k_w(m) / p->thermal_resistance_k_w;
    m->field_c = REFERENCE_C;
    motor_field_init(&m->field, p);
    m->min_inductance_h = fmin(p->ld_h, p->lq_h) / m->field.permeance_max;
    m->longest_turn_rad = longest_turn_rad(m);
    shaft_init(m);
    sincos(p->pole_pairs * m->theta_rad, &m->sin_e, &m->cos_e);
    motor_follow_temperature(m);
    motor_set_current(m, 0, 0);
}

double motor_resistance_ohm(const struct motor *m)
{
    return m->p.resistance_ohm * (1.0 + m->p.copper_tempco_per_k * (m->winding_c - REFERENCE_C));
}

double motor_torque_nm(const struct motor *m)
{
    return m->torque_nm;
}

double motor_min_inductance_h(const struct motor *m)
{
    return m->min_inductance_h;
}

double motor_magnetic_energy_j(const struct motor *m)
{
    return motor_field_energy(&m->field, &m->at) + 0.5 * m->fault.loop_h * m->loop_a * m->loop_a;
}

/* ---- currents ---- */

static struct dq terminal_dq(const struct motor *m)
{
    struct dq i = {m->i_d_a, m->i_q_a};
    if (!m->fault.present) {
        return i;
    }
    return with_loop(&m->fault, i, phase_axis(m->fault.phase, m->sin_e, m->cos_e), m->loop_a);
}

void motor_currents(const struct motor *m, double i_a[3])
{
    to_phases(terminal_dq(m), m->sin_e, m->cos_e, i_a);
}

bool motor_set_current(struct motor *m, double i_d_a, double i_q_a)
{
    if (!motor_field_flux(&m->field, (struct dq){i_d_a, i_q_a}, m->sin_e, m->cos_e, &m->psi_vs)) {
        return false;
    }
    motor_follow_flux(m);
    return true;
}

/* ---- phases without current ---- */

/* A blow of volt seconds on the winding. */
static void strike(struct motor *m, struct dq volt_seconds, struct dq fault)
{
    m->psi_vs = plus(m->psi_vs, 1, volt_seconds);
    m->loop_a += m->fault.fraction * m->fault.loop_per_h * dot(volt_seconds, fault);
    motor_follow_flux(m);
}

/* Once, unless the map bends: then by Newton's method, until rounding lets it come no closer. */
void motor_hold_phase(struct motor *m, int phase)
{
    struct dq axis = phase_axis(phase, m->sin_e, m->cos_e), fault = phase_axis(m->fault.phase, m->sin_e, m->cos_e);
    double before_a = INFINITY;
    for (int n = 0; n < 50; n++) {
        double i_a = dot(terminal_dq(m), axis);
        if (i_a == 0 || fabs(i_a) >= before_a) {
            return;
        }
        double blow_vs = -i_a / along(terminal_slopes(m, &m->at, fault), axis);
        strike(m, (struct dq){blow_vs * axis.d, blow_vs * axis.q}, fault);
        before_a = fabs(i_a);
    }
}

void motor_hold_all(struct motor *m)
{
    struct dq fault = phase_axis(m->fault.phase, m->sin_e, m->cos_e);
    double before_a = INFINITY;
    for (int n = 0; n < 50; n++) {
        struct dq i = terminal_dq(m);
        double i_a = fabs(i.d) + fabs(i.q);
        if (i_a == 0 || i_a >= before_a) {
            return;
        }
        struct dq blow = slopes_solve(terminal_slopes(m, &m->at, fault), i);
        strike(m, (struct dq){-blow.d, -blow.q}, fault);
        before_a = i_a;
    }
}

/* ---- from outside ---- */

void motor_short_winding(struct motor *m, int phase, double fraction, double r_ohm)
{
    m->loop_a = 0;
    m->fault = winding_short_at(phase, fraction, r_ohm, motor_resistance_ohm(m), m->min_inductance_h);
}

void motor_mend_winding(struct motor *m)
{
    m->loop_a = 0;
    m->fault = (struct winding_short){.present = false};
}
