/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "motor_map.h"

#include <string.h>

/* Exponents are whole and at most 8: no pow() in what runs fifty times a PWM period. */
static inline double power(double x, unsigned n)
{
    double x2 = x * x;
    switch (n) {
    case 0:
        return 1;
    case 1:
        return x;
    case 2:
        return x2;
    case 3:
        return x2 * x;
    case 4:
        return x2 * x2;
    case 5:
        return x2 * x2 * x;
    case 6:
        return x2 * x2 * x2;
    case 7:
        return x2 * x2 * x2 * x;
    default:
        return x2 * x2 * (x2 * x2);
    }
}

/* Of the bridges: x^2, x^W and the conductance G_b. */
struct bridge_point {
    double d, xx, xw, conductance;
};

static inline struct bridge_point bridge_at(const struct motor_map *m, struct dq psi)
{
    struct bridge_point b = {.d = psi.d - m->psi_n_vs};
    b.xx = b.d * b.d + m->k_q * psi.q * psi.q;
    b.xw = m->w == 2 ? b.xx : b.xx * b.xx;
    b.conductance = m->a_b * b.xw / (1 + m->a_bp * b.xw);
    return b;
}

/* The powers of a flux linkage that current and energy share. */
struct map_point {
    double dd, qq;         /* squares */
    double self_d, self_q; /* |d|^S, |q|^T */
    double cross;          /* |d|^U |q|^V */
    struct bridge_point bridge;
};

static inline void map_at(const struct motor_map *m, struct dq psi, struct map_point *at)
{
    double d = fabs(psi.d), q = fabs(psi.q);
    at->dd = d * d;
    at->qq = q * q;
    at->self_d = power(d, m->s);
    at->self_q = power(q, m->t);
    at->cross = power(d, m->u) * power(q, m->v);
    if (m->bridges) {
        at->bridge = bridge_at(m, psi);
    }
}

static inline struct dq current_at(const struct motor_map *m, struct dq psi, const struct map_point *at)
{
    struct dq i = {psi.d * (m->a_d0 + m->a_dd * at->self_d + m->dq_by_v * at->cross * at->qq) - m->i_f_a,
                   psi.q * (m->a_q0 + m->a_qq * at->self_q + m->dq_by_u * at->cross * at->dd)};
    if (m->bridges) {
        i.d += at->bridge.conductance * at->bridge.d;
        i.q += at->bridge.conductance * m->k_q * psi.q;
    }
    return i;
}

/* Integral of G_b x dx. */
static inline double bridge_energy(const struct motor_map *m, const struct bridge_point *b)
{
    if (m->a_bp == 0) {
        return m->a_b * b->xw * b->xx / (m->w + 2);
    }
    double rest = m->w == 2 ? log1p(m->a_bp * b->xx) : atan(sqrt(m->a_bp) * b->xx) * sqrt(m->a_bp);
    return m->a_b_over_2bp * (b->xx - rest * m->one_over_bp);
}

static inline double energy_at(const struct motor_map *m, struct dq psi, const struct map_point *at)
{
    double self_d = at->dd * (m->a_d0 / 2 + m->energy_dd * at->self_d) - m->i_f_a * psi.d;
    double self_q = at->qq * (m->a_q0 / 2 + m->energy_qq * at->self_q);
    double cross = m->energy_dq * at->cross * at->dd * at->qq;
    return 1.5 * (self_d + self_q + cross + (m->bridges ? bridge_energy(m, &at->bridge) : 0));
}

struct dq motor_map_current(const struct motor_map *m, struct dq psi)
{
    if (m->linear) {
        return (struct dq){m->a_d0 * (psi.d - m->psi_f_vs), m->a_q0 * psi.q};
    }
    struct map_point at;
    map_at(m, psi, &at);
    return current_at(m, psi, &at);
}

struct dq motor_map_current_energy(const struct motor_map *m, struct dq psi, double *energy_j)
{
    if (m->linear) {
        struct dq i = motor_map_current(m, psi);
        *energy_j = 0.75 * (i.d * (psi.d - m->psi_f_vs) + i.q * psi.q);
        return i;
    }
    struct map_point at;
    map_at(m, psi, &at);
    *energy_j = energy_at(m, psi, &at) - m->energy_f;
    return current_at(m, psi, &at);
}

double motor_map_energy(const struct motor_map *m, struct dq psi)
{
    double energy_j;
    motor_map_current_energy(m, psi, &energy_j);
    return energy_j;
}

struct slopes motor_map_slopes(const struct motor_map *m, struct dq psi)
{
    if (m->linear) {
        return (struct slopes){m->a_d0, 0, m->a_q0};
    }
    struct map_point at;
    map_at(m, psi, &at);
    struct slopes g = {
        .dd = m->a_d0 + (m->s + 1) * m->a_dd * at.self_d + (m->u + 1) * m->dq_by_v * at.cross * at.qq,
        .dq = m->a_dq * at.cross * psi.d * psi.q,
        .qq = m->a_q0 + (m->t + 1) * m->a_qq * at.self_q + (m->v + 1) * m->dq_by_u * at.cross * at.dd,
    };
    if (m->bridges) {
        struct bridge_point b = at.bridge;
        double below = 1 + m->a_bp * b.xw;
        double slope_over_x = m->w * m->a_b * (m->w == 2 ? 1 : b.xx) / (below * below);
        g.dd += b.conductance + slope_over_x * b.d * b.d;
        g.dq += slope_over_x * m->k_q * b.d * psi.q;
        g.qq += m->k_q * (b.conductance + slope_over_x * m->k_q * psi.q * psi.q);
    }
    return g;
}

/* ---- the magnets ---- */

/* The flux linkage at which i_d is zero; i_d rises with it. */
static double without_current(const struct motor_map *m)
{
    double low = 0, high = 1e-9;
    while (motor_map_current(m, (struct dq){high, 0}).d < 0 && high < 1e3) {
        high *= 2;
    }
    for (int n = 0; n < 100 && motor_map_current(m, (struct dq){0, 0}).d < 0; n++) {
        double middle = (low + high) / 2;
        *(motor_map_current(m, (struct dq){middle, 0}).d < 0 ? &low : &high) = middle;
    }
    return low;
}

void motor_map_magnet(struct motor_map *m, double share)
{
    m->psi_f_vs = m->cold_psi_f_vs * share;
    if (m->linear) {
        return;
    }
    m->i_f_a = m->cold_i_f_a * share;
    m->psi_n_vs = m->cold_psi_n_vs * share;
    m->psi_f_vs = without_current(m);
    m->energy_f = 0;
    m->energy_f = motor_map_energy(m, (struct dq){m->psi_f_vs, 0});
}

void motor_map_init(struct motor_map *m, const struct motor_params *p)
{
    memset(m, 0, sizeof *m);
    m->linear = p->sat_a_d0 == 0;
    if (m->linear) {
        m->a_d0 = 1 / p->ld_h;
        m->a_q0 = 1 / p->lq_h;
        m->cold_psi_f_vs = m->psi_f_vs = p->flux_wb;
        return;
    }
    *m = (struct motor_map){
        .bridges = p->sat_a_b > 0,
        .s = (unsigned)p->sat_s,
        .t = (unsigned)p->sat_t,
        .u = (unsigned)p->sat_u,
        .v = (unsigned)p->sat_v,
        .w = (unsigned)p->sat_w,
        .a_d0 = p->sat_a_d0,
        .a_dd = p->sat_a_dd,
        .a_q0 = p->sat_a_q0,
        .a_qq = p->sat_a_qq,
        .a_dq = p->sat_a_dq,
        .a_b = p->sat_a_b,
        .a_bp = p->sat_a_bp,
        .k_q = p->sat_k_q,
        .dq_by_v = p->sat_a_dq / (p->sat_v + 2),
        .dq_by_u = p->sat_a_dq / (p->sat_u + 2),
        .energy_dd = p->sat_a_dd / (p->sat_s + 2),
        .energy_qq = p->sat_a_qq / (p->sat_t + 2),
        .energy_dq = p->sat_a_dq / ((p->sat_u + 2) * (p->sat_v + 2)),
        .one_over_bp = 1 / p->sat_a_bp,
        .a_b_over_2bp = p->sat_a_b / (2 * p->sat_a_bp),
        .cold_i_f_a = p->sat_i_f_a,
        .i_f_a = p->sat_i_f_a,
        .cold_psi_n_vs = p->sat_psi_n_wb,
        .psi_n_vs = p->sat_psi_n_wb,
    };
    m->psi_f_vs = m->cold_psi_f_vs = without_current(m);
    m->energy_f = 0;
    m->energy_f = motor_map_energy(m, (struct dq){m->psi_f_vs, 0});
}

/* ---- the other way round ---- */

/* Newton's method; a whole step may overshoot, because the powers are steep. */
bool motor_map_flux(const struct motor_map *m, struct dq i, struct dq *psi)
{
    struct dq off = motor_map_current(m, *psi = (struct dq){m->psi_f_vs, 0});
    off = (struct dq){off.d - i.d, off.q - i.q};
    double error_a = hypot(off.d, off.q), share = 1;
    for (int n = 0; n < 200 && error_a > 0 && share > 1e-6; n++) {
        struct dq step = slopes_solve(motor_map_slopes(m, *psi), off);
        struct dq next = {psi->d - share * step.d, psi->q - share * step.q};
        struct dq got = motor_map_current(m, next);
        struct dq next_off = {got.d - i.d, got.q - i.q};
        double next_a = hypot(next_off.d, next_off.q);
        if (next_a < error_a) {
            *psi = next;
            off = next_off;
            error_a = next_a;
            share = 1;
        } else {
            share /= 2;
        }
    }
    return error_a <= 1e-9 * (1 + hypot(i.d, i.q));
}

bool motor_map_monotone(const struct motor_map *m, double i_max_a)
{
    const int directions = 48, rings = 10;
    const double turn = 6.283185307179586;
    for (int n = 0; n < directions * rings; n++) {
        double i_a = i_max_a * (1 + n / directions) / rings, angle = turn * (n % directions) / directions;
        struct dq psi;
        if (!motor_map_flux(m, (struct dq){i_a * cos(angle), i_a * sin(angle)}, &psi)) {
            return false;
        }
        struct slopes g = motor_map_slopes(m, psi);
        if (!(g.dd > 0 && slopes_determinant(g) > 0)) {
            return false;
        }
    }
    return true;
}
