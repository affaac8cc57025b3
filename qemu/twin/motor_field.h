/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The field in the air gap: the flux map, and what varies with the rotor's angle on top of it.
 *
 * Harmonics of the magnets' flux. Phase A links psi_f (cos th + sum of e_n/n cos n th), n = 6k-1 or 6k+1. In the rotor's
 * frame each is one of order 6k: d gets e_n/n psi_f cos 6k th, q gets +-e_n/n psi_f sin 6k th (+ for 6k+1). The map then
 * takes psi' = psi - psi_h(th).
 * Slots add to the energy (slots.h), of the same psi'.
 * Permeance. i = e(th) f(psi'), with e = 1 + eps6 cos 6th + eps12 cos 12th; the energy carries the same factor.
 *
 * Torque follows from the balance of power, so that no energy is made:
 *   T = 3/2 p (psi_d i_q - psi_q i_d) + 3/2 p (i_d dpsi_hd/dth + i_q dpsi_hq/dth) - p dW/dth at constant psi' */
#ifndef TWIN_MOTOR_FIELD_H
#define TWIN_MOTOR_FIELD_H

#include "slots.h"

#define FIELD_ORDERS 3 /* 6, 12, 18 */

struct motor_field {
    struct motor_map map;
    bool emf_harmonics, permeance_varies;
    double share_d[FIELD_ORDERS], share_q[FIELD_ORDERS]; /* of psi_f */
    double eps_6, eps_12;
    struct slots slots;
    double permeance_max; /* an upper bound */
    double pole_pairs;
    double highest_order; /* per electrical turn; 0: nothing varies */
};

/* The field at one flux linkage and angle. */
struct field_point {
    struct dq i;           /* current */
    struct dq f;           /* current of the map alone */
    struct dq own;         /* psi' */
    struct dq magnet;      /* psi_f and psi_h: the flux linkage without current */
    struct dq turn;        /* dpsi_h/dth */
    double permeance;      /* e */
    double permeance_turn; /* de/dth */
    double map_j;          /* energy of the map, known where the permeance varies */
    struct slots_angle slots;
    struct slots_point slotted;
    double torque_nm;
};

void motor_field_init(struct motor_field *f, const struct motor_params *p);
/* At the angle whose sine and cosine are s and c. */
void motor_field_at(const struct motor_field *f, struct dq psi, double s, double c, struct field_point *at);
/* di/dpsi there. */
struct slopes motor_field_slopes(const struct motor_field *f, const struct field_point *at);
/* di/dtheta at a flux linkage that turns along with the magnets' harmonics. */
struct dq motor_field_turn(const struct motor_field *f, const struct field_point *at);
/* The flux linkage of a current at this angle. False, and no change, if the map does not reach there. */
bool motor_field_flux(const struct motor_field *f, struct dq i, double s, double c, struct dq *psi);
/* At least the smallest incremental inductance of any direction, at any angle. */
double motor_field_least_h(const struct motor_field *f, const struct field_point *at);
double motor_field_energy(const struct motor_field *f, const struct field_point *at);

#endif
