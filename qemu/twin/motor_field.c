/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "motor_field.h"

#include <string.h>

void motor_field_init(struct motor_field *f, const struct motor_params *p)
{
    const double below[FIELD_ORDERS] = {p->emf_5 / 5, p->emf_11 / 11, p->emf_17 / 17};
    const double above[FIELD_ORDERS] = {p->emf_7 / 7, p->emf_13 / 13, p->emf_19 / 19};
    memset(f, 0, sizeof *f);
    motor_map_init(&f->map, p);
    for (int k = 0; k < FIELD_ORDERS; k++) {
        f->share_d[k] = above[k] + below[k];
        f->share_q[k] = above[k] - below[k];
        if (above[k] != 0 || below[k] != 0) {
            f->emf_harmonics = true;
            f->highest_order = 6 * (k + 1);
        }
    }
    f->eps_6 = p->permeance_6;
    f->eps_12 = p->permeance_12;
    f->permeance_max = 1 + fabs(f->eps_6) + fabs(f->eps_12);
    f->permeance_varies = f->eps_6 != 0 || f->eps_12 != 0;
    f->highest_order = fmax(f->highest_order, f->eps_12 != 0 ? 12 : f->permeance_varies ? 6 : 0);
    slots_init(&f->slots, p);
    f->highest_order = f->slots.present ? 36 : f->highest_order;
    f->pole_pairs = p->pole_pairs;
}

/* Cosine and sine of 6, 12 and 18 times the angle, by multiplying complex numbers. */
static inline void multiples(double s, double c, double cos_k[FIELD_ORDERS], double sin_k[FIELD_ORDERS])
{
    double c2 = c * c - s * s, s2 = 2 * s * c;
    double c3 = c2 * c - s2 * s, s3 = c2 * s + s2 * c;
    cos_k[0] = c3 * c3 - s3 * s3;
    sin_k[0] = 2 * s3 * c3;
    cos_k[1] = cos_k[0] * cos_k[0] - sin_k[0] * sin_k[0];
    sin_k[1] = 2 * sin_k[0] * cos_k[0];
    cos_k[2] = cos_k[1] * cos_k[0] - sin_k[1] * sin_k[0];
    sin_k[2] = cos_k[1] * sin_k[0] + sin_k[1] * cos_k[0];
}

static void add_harmonics(const struct motor_field *f, double s, double c, struct field_point *at)
{
    double cos_k[FIELD_ORDERS], sin_k[FIELD_ORDERS];
    multiples(s, c, cos_k, sin_k);
    if (f->emf_harmonics) {
        double psi_f = f->map.psi_f_vs;
        const double *d = f->share_d, *q = f->share_q;
        at->magnet.d += psi_f * (d[0] * cos_k[0] + d[1] * cos_k[1] + d[2] * cos_k[2]);
        at->magnet.q = psi_f * (q[0] * sin_k[0] + q[1] * sin_k[1] + q[2] * sin_k[2]);
        at->turn.d = -6 * psi_f * (d[0] * sin_k[0] + 2 * d[1] * sin_k[1] + 3 * d[2] * sin_k[2]);
        at->turn.q = 6 * psi_f * (q[0] * cos_k[0] + 2 * q[1] * cos_k[1] + 3 * q[2] * cos_k[2]);
    }
    at->permeance += f->eps_6 * cos_k[0] + f->eps_12 * cos_k[1];
    at->permeance_turn = -6 * (f->eps_6 * sin_k[0] + 2 * f->eps_12 * sin_k[1]);
    if (f->slots.present) {
        slots_turn(&f->slots, cos_k, sin_k, &at->slots);
    }
}

void motor_field_at(const struct motor_field *f, struct dq psi, double s, double c, struct field_point *at)
{
    at->magnet = (struct dq){f->map.psi_f_vs, 0};
    at->turn = (struct dq){0, 0};
    at->permeance = 1;
    at->permeance_turn = 0;
    if (f->highest_order > 0) {
        add_harmonics(f, s, c, at);
    }
    at->own = (struct dq){psi.d - (at->magnet.d - f->map.psi_f_vs), psi.q - at->magnet.q};
    at->f = f->permeance_varies ? motor_map_current_energy(&f->map, at->own, &at->map_j)
                                : motor_map_current(&f->map, at->own);
    at->i = (struct dq){at->permeance * at->f.d, at->permeance * at->f.q};
    if (f->slots.present) {
        slots_at(&at->slots, at->own.d - f->map.psi_f_vs, at->own.q, &at->slotted);
        at->i = (struct dq){at->i.d + at->slotted.current.d, at->i.q + at->slotted.current.q};
    }
    double work = psi.d * at->i.q - psi.q * at->i.d + at->i.d * at->turn.d + at->i.q * at->turn.q;
    at->torque_nm = 1.5 * f->pole_pairs * work;
    if (f->permeance_varies) {
        at->torque_nm -= f->pole_pairs * at->permeance_turn * at->map_j;
    }
    if (f->slots.present) {
        at->torque_nm -= f->pole_pairs * at->slotted.energy_turn_j;
    }
}

struct slopes motor_field_slopes(const struct motor_field *f, const struct field_point *at)
{
    struct slopes g = motor_map_slopes(&f->map, at->own);
    g = (struct slopes){at->permeance * g.dd, at->permeance * g.dq, at->permeance * g.qq};
    if (f->slots.present) {
        struct slopes more = slots_slopes(&at->slots, at->own.d - f->map.psi_f_vs, at->own.q);
        g = (struct slopes){g.dd + more.dd, g.dq + more.dq, g.qq + more.qq};
    }
    return g;
}

struct dq motor_field_turn(const struct motor_field *f, const struct field_point *at)
{
    struct dq turn = {at->permeance_turn * at->f.d, at->permeance_turn * at->f.q};
    if (f->slots.present) {
        turn = (struct dq){turn.d + at->slotted.current_turn.d, turn.q + at->slotted.current_turn.q};
    }
    return turn;
}

double motor_field_least_h(const struct motor_field *f, const struct field_point *at)
{
    double steepest = f->permeance_max * slopes_largest(motor_map_slopes(&f->map, at->own));
    if (f->slots.present) {
        steepest += slots_steepest(&f->slots, at->own.d - f->map.psi_f_vs, at->own.q);
    }
    return 1 / steepest;
}

/* Where slots add to the map, from its flux linkage on by Newton's method. */
bool motor_field_flux(const struct motor_field *f, struct dq i, double s, double c, struct dq *psi)
{
    struct field_point at;
    struct dq own;
    motor_field_at(f, *psi, s, c, &at);
    if (!motor_map_flux(&f->map, (struct dq){i.d / at.permeance, i.q / at.permeance}, &own)) {
        return false;
    }
    psi->d = own.d + (at.magnet.d - f->map.psi_f_vs);
    psi->q = own.q + at.magnet.q;
    for (int n = 0; f->slots.present && n < 20; n++) {
        motor_field_at(f, *psi, s, c, &at);
        struct dq step = slopes_solve(motor_field_slopes(f, &at), (struct dq){at.i.d - i.d, at.i.q - i.q});
        *psi = (struct dq){psi->d - step.d, psi->q - step.q};
    }
    return true;
}

double motor_field_energy(const struct motor_field *f, const struct field_point *at)
{
    return at->permeance * motor_map_energy(&f->map, at->own) + (f->slots.present ? at->slotted.energy_j : 0);
}
