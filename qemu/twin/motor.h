/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Permanent-magnet synchronous machine with a star point that is not connected, and what hangs on its shaft.
 *
 * Conventions: amplitude-invariant transforms; phase current positive into the motor; electrical angle 0 has the
 * magnet's flux along phase A; SI units. The machine sees its supply as a linear source, so that it need not know what
 * an inverter is. */
#ifndef TWIN_MOTOR_H
#define TWIN_MOTOR_H

#include <stdbool.h>

#include "keys.h"

struct motor_params {
    double pole_pairs;
    double resistance_ohm; /* of one phase, at 25 degrees */
    double ld_h;
    double lq_h;
    double flux_wb; /* peak flux linkage of one phase */
    double inertia_kgm2;
    double friction_coulomb_nm;
    double friction_viscous_nms;
    double cogging_nm; /* peak */
    double cogging_per_rev;
    double copper_tempco_per_k;
    double thermal_resistance_k_w; /* winding to ambient */
    double thermal_capacity_j_k;
    double ambient_c;
    double initial_angle_rad;
};

struct load_params {
    double inertia_kgm2;
    double viscous_nms;
};

extern const struct config_key motor_keys[];
extern const struct config_key load_keys[];

/* The voltage of terminal k against any common reference is emf_v[k] - sum over l of r_ohm[k][l] * i[l]. A held phase
 * carries no current: its terminal floats, or its wire is broken; emf_v and r_ohm of it do not matter. */
struct motor_source {
    double emf_v[3];
    double r_ohm[3][3];
    bool held[3];
};

enum shaft { SHAFT_FREE, SHAFT_LOCKED, SHAFT_SPUN };

struct motor {
    struct motor_params p;
    struct load_params load;

    double i_d_a, i_q_a;
    double speed_rad_s; /* mechanical */
    double theta_rad;   /* mechanical, continuous over turns */
    double winding_c;
    double sin_e, cos_e; /* of the electrical angle, kept with theta_rad */

    enum shaft shaft;
    bool stuck;     /* free, but held by Coulomb friction */
    double load_nm; /* external torque against positive rotation, whatever the speed */

    double volt_alpha_vs, volt_beta_vs; /* integrals of the phase voltages against the star point */
    double energy_in_j, energy_copper_j, energy_airgap_j;
};

void motor_init(struct motor *m, const struct motor_params *p, const struct load_params *load);

/* Advances by dt_s with the given source (fourth-order Runge-Kutta). The caller keeps dt_s below motor_max_step_s(). */
void motor_step(struct motor *m, const struct motor_source *source, double dt_s);

/* Longest step that resolves L/R (with source_r_ohm in series) and the electrical angle. */
double motor_max_step_s(const struct motor *m, double source_r_ohm);

void motor_currents(const struct motor *m, double i_a[3]);
/* Voltages of the terminals against the star point now, floating ones included. */
void motor_star_voltages(const struct motor *m, const struct motor_source *source, double v_v[3]);
/* Removes the last rounding of a current that has just become zero. */
void motor_hold_phase(struct motor *m, int phase);

double motor_torque_nm(const struct motor *m); /* electromagnetic, in the air gap */
double motor_resistance_ohm(const struct motor *m);
double motor_magnetic_energy_j(const struct motor *m);

void motor_lock(struct motor *m, bool locked);
void motor_spin(struct motor *m, double speed_rad_s);
void motor_release(struct motor *m);

#endif
