/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE
#include "shaft.h"

#include "extremes.h"
#include "turn.h"

#define RATCHET_SHARE   0.25 /* of what a hoist pulls: what it takes to let it down from rest, so that cogging does not */
#define COGGING_AGE_MAX 64   /* turned so often, rounding begins to add up */

static inline bool is_rigid(const struct motor *m)
{
    return m->load.stiffness_nm_rad == 0;
}

/* ---- torques ---- */

static double breakaway_nm(const struct load_params *l)
{
    return larger(l->coulomb_nm, l->stiction_nm);
}

static inline double load_friction_nm(const struct load_params *l, double speed_rad_s)
{
    if (l->stiction_nm <= l->coulomb_nm) {
        return l->coulomb_nm;
    }
    double x = speed_rad_s / l->stribeck_rad_s;
    return l->coulomb_nm + (l->stiction_nm - l->coulomb_nm) / (1 + x * x);
}

static inline double spring_nm(const struct motor *m, const double y[STATES])
{
    return m->load.stiffness_nm_rad * y[TWIST] + m->load.damping_nms * (y[SPEED] - y[LOAD_SPEED]);
}

/* Exactly, at the present angle. */
static void cogging_anchor(struct motor *m)
{
    const struct motor_params *p = &m->p;
    const double terms[COGGING_TERMS][3] = {{p->cogging_nm, p->cogging_per_rev, p->cogging_rad},
                                            {p->cogging2_nm, p->cogging2_per_rev, p->cogging2_rad},
                                            {p->cogging3_nm, p->cogging3_per_rev, p->cogging3_rad}};
    m->cogging_terms = 0;
    m->cogging_age = 0;
    for (int n = 0; n < COGGING_TERMS; n++) {
        if (terms[n][0] != 0 && terms[n][1] != 0) {
            double s, c;
            sincos(terms[n][1] * m->theta_rad + terms[n][2], &s, &c);
            m->cogging[m->cogging_terms++] = (struct cogging){terms[n][1], terms[n][0] * s, terms[n][0] * c};
        }
    }
}

static inline struct cogging cogging_turned(const struct cogging *g, double angle_rad)
{
    struct cogging turned = {.per_rev = g->per_rev};
    turn_by(g->per_rev * angle_rad, g->sin_nm, g->cos_nm, &turned.sin_nm, &turned.cos_nm);
    return turned;
}

static inline double cogging_nm(const struct motor *m, double theta_rad)
{
    double sum_nm = 0;
    for (int n = 0; n < m->cogging_terms; n++) {
        sum_nm += cogging_turned(&m->cogging[n], theta_rad - m->theta_rad).sin_nm;
    }
    return sum_nm;
}

void shaft_turn(struct motor *m, double theta_rad)
{
    double angle_rad = theta_rad - m->theta_rad;
    m->theta_rad = theta_rad;
    if (m->cogging_terms > 0 && ++m->cogging_age >= COGGING_AGE_MAX) {
        cogging_anchor(m);
        return;
    }
    for (int n = 0; n < m->cogging_terms; n++) {
        m->cogging[n] = cogging_turned(&m->cogging[n], angle_rad);
    }
}

/* ---- rest and motion ---- */

/* The way a mass moves, or begins to move from rest under a pull: 0 if nothing depends on it. *stuck if it stays. */
static double direction_of(double speed_rad_s, double pull_nm, double holds_nm, double hoist_nm, bool *stuck)
{
    *stuck = false;
    if (holds_nm == 0 && hoist_nm == 0) {
        return 0;
    }
    if (speed_rad_s != 0) {
        return speed_rad_s > 0 ? 1 : -1;
    }
    double up_nm = holds_nm + larger(hoist_nm, -RATCHET_SHARE * hoist_nm);
    double down_nm = holds_nm + larger(-hoist_nm, RATCHET_SHARE * hoist_nm);
    bool above = pull_nm > up_nm, below = pull_nm < -down_nm;
    *stuck = !above && !below;
    return above ? 1 : below ? -1 : 0;
}

static void begin_rigid(struct shaft_step *k, struct motor *m, double pull_nm)
{
    double holds_nm = m->p.friction_coulomb_nm + breakaway_nm(&m->load);
    k->direction = direction_of(m->speed_rad_s, pull_nm - m->load_nm, holds_nm, m->hoist_nm, &m->stuck);
    m->stuck = m->stuck && m->shaft == SHAFT_FREE;
    m->load_stuck = m->stuck;
    k->moves = m->shaft == SHAFT_FREE && !m->stuck;
    k->load_direction = k->direction;
}

static void begin_compliant(struct shaft_step *k, struct motor *m, double pull_nm)
{
    double y[STATES] = {[SPEED] = m->speed_rad_s, [LOAD_SPEED] = m->load_speed_rad_s, [TWIST] = m->twist_rad};
    double between_nm = spring_nm(m, y);
    k->direction = direction_of(m->speed_rad_s, pull_nm - between_nm, m->p.friction_coulomb_nm, 0, &m->stuck);
    k->load_direction =
        direction_of(m->load_speed_rad_s, between_nm - m->load_nm, breakaway_nm(&m->load), m->hoist_nm, &m->load_stuck);
    m->stuck = m->stuck && m->shaft != SHAFT_LOCKED;
    m->load_stuck = m->load_stuck && m->shaft != SHAFT_SPUN;
    k->moves = m->shaft != SHAFT_LOCKED && !m->stuck;
    k->load_moves = m->shaft != SHAFT_SPUN && !m->load_stuck;
}

void shaft_begin(struct shaft_step *k, struct motor *m, double airgap_nm)
{
    *k = (struct shaft_step){.m = m, .rigid = is_rigid(m)};
    double pull_nm = airgap_nm - cogging_nm(m, m->theta_rad);
    if (k->rigid) {
        begin_rigid(k, m, pull_nm);
    } else {
        begin_compliant(k, m, pull_nm);
    }
}

void shaft_end(const struct shaft_step *k, double y[STATES])
{
    if (k->moves && y[SPEED] * k->direction < 0) {
        y[SPEED] = 0;
    }
    if (k->rigid) {
        y[LOAD_SPEED] = y[SPEED];
    } else if (k->load_moves && y[LOAD_SPEED] * k->load_direction < 0) {
        y[LOAD_SPEED] = 0;
    }
}

void shaft_derivative(const struct shaft_step *k, const double y[STATES], double airgap_nm, double drag_nm,
                      double dy[SLOPES])
{
    const struct motor *m = k->m;
    const struct load_params *l = &m->load;
    double speed = y[SPEED], load_speed = k->rigid ? speed : y[LOAD_SPEED];
    double friction_nm = m->p.friction_coulomb_nm * k->direction + m->p.friction_viscous_nms * speed;
    double load_friction = load_friction_nm(l, load_speed) * k->load_direction + l->viscous_nms * load_speed;
    double work_nm = m->load_nm + m->hoist_nm + l->fan_nms2 * load_speed * fabs(load_speed);
    double on_motor_nm = airgap_nm - cogging_nm(m, y[THETA]) - drag_nm - friction_nm;
    double on_load_nm = -load_friction - work_nm;

    dy[THETA] = speed;
    dy[E_IRON] = drag_nm * speed;
    dy[E_FRICTION] = friction_nm * speed + load_friction * load_speed;
    dy[E_LOAD] = work_nm * load_speed;
    dy[E_DRIVER] = 0;
    if (k->rigid) {
        double accelerating_nm = on_motor_nm + on_load_nm;
        dy[SPEED] = k->moves ? accelerating_nm / (m->p.inertia_kgm2 + l->inertia_kgm2) : 0;
        dy[LOAD_SPEED] = dy[SPEED];
        dy[TWIST] = 0;
        dy[E_DRIVER] = m->shaft == SHAFT_SPUN ? -accelerating_nm * speed : 0;
        return;
    }
    double between_nm = spring_nm(m, y);
    dy[SPEED] = k->moves ? (on_motor_nm - between_nm) / m->p.inertia_kgm2 : 0;
    dy[LOAD_SPEED] = k->load_moves ? (on_load_nm + between_nm) / l->inertia_kgm2 : 0;
    dy[TWIST] = speed - load_speed;
    dy[E_FRICTION] += l->damping_nms * (speed - load_speed) * (speed - load_speed);
    dy[E_DRIVER] = m->shaft == SHAFT_SPUN ? -(on_load_nm + between_nm) * load_speed : 0;
}

static double longest_step_s(const struct motor *m)
{
    if (is_rigid(m)) {
        return INFINITY;
    }
    double per_inertia = 1 / m->p.inertia_kgm2 + 1 / m->load.inertia_kgm2;
    return lesser(0.1 / sqrt(m->load.stiffness_nm_rad * per_inertia), 0.3 / (m->load.damping_nms * per_inertia));
}

void shaft_init(struct motor *m)
{
    m->longest_shaft_s = longest_step_s(m);
    cogging_anchor(m);
}

/* ---- from outside ---- */

static double cogging_j(double nm, double per_rev, double start_rad, double theta_rad)
{
    return per_rev == 0 ? 0 : -nm / per_rev * cos(per_rev * theta_rad + start_rad);
}

double motor_mechanical_energy_j(const struct motor *m)
{
    const struct motor_params *p = &m->p;
    double load_rad_s = is_rigid(m) ? m->speed_rad_s : m->load_speed_rad_s;
    double moving_j =
        p->inertia_kgm2 * m->speed_rad_s * m->speed_rad_s + m->load.inertia_kgm2 * load_rad_s * load_rad_s;
    double twisted_j = m->load.stiffness_nm_rad * m->twist_rad * m->twist_rad;
    return 0.5 * (moving_j + twisted_j) + cogging_j(p->cogging_nm, p->cogging_per_rev, p->cogging_rad, m->theta_rad) +
           cogging_j(p->cogging2_nm, p->cogging2_per_rev, p->cogging2_rad, m->theta_rad) +
           cogging_j(p->cogging3_nm, p->cogging3_per_rev, p->cogging3_rad, m->theta_rad);
}

void motor_lock(struct motor *m, bool locked)
{
    m->shaft = locked ? SHAFT_LOCKED : SHAFT_FREE;
    if (locked) {
        m->speed_rad_s = 0;
        m->load_speed_rad_s = is_rigid(m) ? 0 : m->load_speed_rad_s;
    }
}

/* Behind a compliant shaft the motor is taken to turn along already. */
void motor_spin(struct motor *m, double speed_rad_s)
{
    m->shaft = SHAFT_SPUN;
    m->speed_rad_s = speed_rad_s;
    m->load_speed_rad_s = speed_rad_s;
}

void motor_release(struct motor *m)
{
    m->shaft = SHAFT_FREE;
}
