/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What slots and barriers add to the field's energy over the angle, in J:
 *
 *   dW = sum over n of 6, 12, 18, 36:  cos n th [xx x^2 + qq q^2 + xqq x q^2 + q4 q^4] + sin n th [xq x q + q3 q^3]
 *   x = psi_d - psi_f, q = psi_q
 *
 * The forms are those that a machine has whose two halves mirror each other, dW(d, q, th) = dW(d, -q, -th), up to what
 * finite elements of THOR show; without current nothing is left. Currents, torque and inductances follow from the energy, so
 * that none is made. */
#ifndef TWIN_SLOTS_H
#define TWIN_SLOTS_H

#include "motor_map.h"

struct slots {
    bool present;
    double c[SLOT_ORDERS][SLOT_FORMS];
    double steepest[SLOT_FORMS]; /* sums of their sizes over the orders */
};

/* At one angle: the sums over the orders, and their derivatives by the angle. */
struct slots_angle {
    double now[SLOT_FORMS], turn[SLOT_FORMS];
};

/* At one flux linkage too; current is what it adds to i, and so on. */
struct slots_point {
    double energy_j, energy_turn_j;
    struct dq current, current_turn;
};

void slots_init(struct slots *s, const struct motor_params *p);
/* From cosine and sine of 6, 12 and 18 times the angle. */
void slots_turn(const struct slots *s, const double cos_k[3], const double sin_k[3], struct slots_angle *a);
void slots_at(const struct slots_angle *a, double x, double q, struct slots_point *at);
/* What they add to di/dpsi. */
struct slopes slots_slopes(const struct slots_angle *a, double x, double q);
/* No direction and angle adds more than this. */
double slots_steepest(const struct slots *s, double x, double q);

#endif
