/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The currents that a flux linkage needs, in the rotor's dq frame, and the field's energy.
 *
 *   i_d = d [a_d0 + a_dd |d|^S + a_dq/(V+2) |d|^U |q|^(V+2)] + G_b (d - psi_n) - i_f
 *   i_q = q [a_q0 + a_qq |q|^T + a_dq/(U+2) |d|^(U+2) |q|^V] + k_q G_b q
 *   G_b = a_b x^W / (1 + a_bp x^W),  x^2 = (d - psi_n)^2 + k_q q^2
 *
 * Sources: M. Hinkkanen et al., IEEE Trans. Ind. Appl. 2017, doi 10.1109/TIA.2016.2644624 (the self- and cross-saturation);
 * L. Lelli et al., ICEM 2024, doi 10.1109/ICEM60801.2024.10700403 (iron bridges G_b beside the magnet psi_n). A magnet in
 * series with a gap is the current i_f. The linear machine is a_d0 = 1/Ld, a_q0 = 1/Lq, i_f = psi/Ld. The field's energy is
 * the integral of 3/2 (i_d dd + i_q dq), which depends on no path: the map is reciprocal by its form. */
#ifndef TWIN_MOTOR_MAP_H
#define TWIN_MOTOR_MAP_H

#include <stdbool.h>

#include "motor_params.h"

struct dq {
    double d, q;
};

/* Inverse incremental inductances, di/dpsi. */
struct slopes {
    double dd, dq, qq;
};

struct motor_map {
    bool linear, bridges;
    unsigned s, t, u, v, w;
    double a_d0, a_dd, a_q0, a_qq, a_dq, a_b, a_bp, k_q;
    double dq_by_v, dq_by_u;                /* a_dq/(V+2), a_dq/(U+2) */
    double energy_dd, energy_qq, energy_dq; /* the same coefficients integrated */
    double one_over_bp, a_b_over_2bp;
    double cold_psi_f_vs, cold_i_f_a, cold_psi_n_vs; /* of the magnets at 25 degrees */
    /* as warm as the magnets are: */
    double psi_n_vs, i_f_a;
    double psi_f_vs; /* flux linkage without current */
    double energy_f; /* value of the energy's formula there */
};

void motor_map_init(struct motor_map *m, const struct motor_params *p);
/* Remanence is `share` times that at 25 degrees: i_f and psi_n follow it, and the flux linkage without current what iron and
 * bridges leave of it. */
void motor_map_magnet(struct motor_map *m, double share);

struct dq motor_map_current(const struct motor_map *m, struct dq psi);
/* The same, and the energy at little more expense. */
struct dq motor_map_current_energy(const struct motor_map *m, struct dq psi, double *energy_j);
struct slopes motor_map_slopes(const struct motor_map *m, struct dq psi);
/* Of the field, in J; zero without current. */
double motor_map_energy(const struct motor_map *m, struct dq psi);
/* The flux linkage of a current. False if there is none: the map does not reach there. */
bool motor_map_flux(const struct motor_map *m, struct dq i, struct dq *psi);
/* Whether each flux linkage has its own current, up to currents of this size. */
bool motor_map_monotone(const struct motor_map *m, double i_max_a);

static inline double slopes_determinant(struct slopes g)
{
    return g.dd * g.qq - g.dq * g.dq;
}

/* The larger eigenvalue: one over the smallest incremental inductance of any direction. */
static inline double slopes_largest(struct slopes g)
{
    double half = (g.dd - g.qq) / 2;
    return (g.dd + g.qq) / 2 + sqrt(half * half + g.dq * g.dq);
}

/* G^-1 x */
static inline struct dq slopes_solve(struct slopes g, struct dq x)
{
    double det = slopes_determinant(g);
    return (struct dq){(g.qq * x.d - g.dq * x.q) / det, (g.dd * x.q - g.dq * x.d) / det};
}

#endif
