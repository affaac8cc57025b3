/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The mechanics: one mass, or the motor's and the load's with a spring between them.
 *
 *   J_m dw_m/dt = T - T_cogging - T_iron - B_m w_m - T_friction_m - T_s      T_s = K twist + D (w_m - w_l)
 *   J_l dw_l/dt = T_s - T_load - T_hoist - k w_l |w_l| - B_l w_l - T_friction_l
 *   dtheta/dt = w_m,  dtwist/dt = w_m - w_l
 *
 * A rigid shaft adds the two. Friction is Coulomb's, on the load's side with stiction (Stribeck's curve, as a rational
 * function of the speed): T_c + (T_stiction - T_c) / (1 + (w/w_s)^2) against the motion. A mass at rest stays there until
 * the other torques exceed T_stiction; the hoist's ratchet holds what the hoist pulls on top of that, and lets it down only
 * against a quarter of it. */
#ifndef TWIN_SHAFT_H
#define TWIN_SHAFT_H

#include "motor.h"

/* What the integration carries: states, then what only accumulates. */
enum {
    PSI_D,
    PSI_Q,
    LOOP,
    SPEED,
    THETA,
    LOAD_SPEED,
    TWIST,
    STATES,
    VOLT_ALPHA = STATES,
    VOLT_BETA,
    E_IN,
    E_COPPER,
    E_FAULT,
    E_AIRGAP,
    E_IRON,
    E_FRICTION,
    E_LOAD,
    E_DRIVER,
    SLOPES
};

/* What stays constant within a step. */
struct shaft_step {
    const struct motor *m;
    bool rigid, moves, load_moves;    /* by themselves: not held, stuck or driven */
    double direction, load_direction; /* of the motion that friction opposes; 0: no friction */
};

/* Decides whether each mass moves during the next step. airgap_nm: the torque now. */
void shaft_begin(struct shaft_step *k, struct motor *m, double airgap_nm);
/* Fills in the slopes of the shaft's states and energies. drag_nm: of the iron. */
void shaft_derivative(const struct shaft_step *k, const double y[STATES], double airgap_nm, double drag_nm,
                      double dy[SLOPES]);
/* A mass that would have reversed stops: whether it goes on is decided before the next step. */
void shaft_end(const struct shaft_step *k, double y[STATES]);
/* The rotor has come to this angle. */
void shaft_turn(struct motor *m, double theta_rad);
void shaft_init(struct motor *m);

#endif
