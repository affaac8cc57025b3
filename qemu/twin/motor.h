/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Synchronous machine, with magnets or without, with a star point that is not connected, and what hangs on its shaft.
 *
 * Conventions: amplitude-invariant transforms; phase current positive into the motor; electrical angle 0 has the
 * magnet's flux along phase A; SI units. The machine sees its supply as a linear source, so that it need not know what
 * an inverter is. */
#ifndef TWIN_MOTOR_H
#define TWIN_MOTOR_H

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "motor_field.h"
#include "motor_params.h"
#include "winding_short.h"

/* The voltage of terminal k against any common reference is emf_v[k] - sum over l of r_ohm[k][l] * i[l]. A held phase
 * carries no current: its terminal floats, or its wire is broken; emf_v and r_ohm of it do not matter. */
struct motor_source {
    double emf_v[3];
    double r_ohm[3][3];
    bool held[3];
};

#define COGGING_TERMS 3

struct cogging {
    double per_rev, sin_nm, cos_nm; /* of per_rev times the rotor's angle, times the amplitude */
};

enum shaft { SHAFT_FREE, SHAFT_LOCKED, SHAFT_SPUN };

struct motor {
    struct motor_params p;
    struct load_params load;
    struct motor_field field;
    enum shaft shaft;
    double load_nm;  /* external torque against positive rotation, whatever the speed */
    double hoist_nm; /* the same of a load on a ratchet: it turns nothing from rest */
    struct winding_short fault;
    double longest_turn_rad, longest_shaft_s; /* what a step has to resolve of harmonics and shaft */
    struct field_point at;                    /* of psi_vs, at the present angle */

    /* From here on, what a step changes, all else follows from it: struct motor_state. */
    struct dq psi_vs;        /* flux linkage, the electrical state */
    double i_d_a, i_q_a;     /* what follows from it: currents; motor_set_current() sets both */
    double torque_nm;        /* in the air gap */
    double min_inductance_h; /* incremental, of any direction */
    double loop_a;           /* in shorted turns, beside them */
    double speed_rad_s;      /* mechanical */
    double theta_rad;        /* mechanical, continuous over turns */
    double load_speed_rad_s; /* the same as speed_rad_s on a rigid shaft */
    double twist_rad;        /* of a compliant shaft */
    double winding_c, housing_c;
    double field_c;      /* temperature of the magnets that the field is for; it follows in small steps */
    double sin_e, cos_e; /* of the electrical angle, kept with theta_rad */

    bool stuck;      /* free, but held by friction */
    bool load_stuck; /* the load behind a compliant shaft */
    struct cogging cogging[COGGING_TERMS];
    int cogging_terms, cogging_age;

    /* Integrals since the beginning. */
    double volt_alpha_vs, volt_beta_vs; /* of the phase voltages against the star point */
    double energy_in_j, energy_copper_j, energy_fault_j, energy_airgap_j;
    double energy_iron_j, energy_friction_j; /* friction: also of the load and in the shaft between */
    double energy_load_j;                    /* done on load_nm, hoist_nm and the fan */
    double energy_driver_j;                  /* of whoever spins the shaft, into it */
};

/* A step that is tried again begins with the motor as it was before. */
struct motor_state {
    char bytes[sizeof(struct motor) - offsetof(struct motor, psi_vs)];
};

static inline void motor_keep(const struct motor *m, struct motor_state *s)
{
    memcpy(s->bytes, &m->psi_vs, sizeof s->bytes);
}

void motor_put_back(struct motor *m, const struct motor_state *s);

void motor_init(struct motor *m, const struct motor_params *p, const struct load_params *load);

/* Advances by dt_s with the given source (fourth-order Runge-Kutta). The caller keeps dt_s below motor_max_step_s(). */
void motor_step(struct motor *m, const struct motor_source *source, double dt_s);

/* Longest step that resolves L/R (with source_r_ohm in series), the angle and the shaft. */
double motor_max_step_s(const struct motor *m, double source_r_ohm);

/* Of the terminals. */
void motor_currents(const struct motor *m, double i_a[3]);
/* False, and no change, if the flux map does not reach there. */
bool motor_set_current(struct motor *m, double i_d_a, double i_q_a);
/* Voltages of the terminals against the star point now, floating ones included. */
void motor_star_voltages(const struct motor *m, const struct motor_source *source, double v_v[3]);
/* Removes the last rounding of a current that has just become zero; of one that flows, the flux its wire takes along. */
void motor_hold_phase(struct motor *m, int phase);

double motor_torque_nm(const struct motor *m);
double motor_min_inductance_h(const struct motor *m);
double motor_resistance_ohm(const struct motor *m);
double motor_magnet_c(const struct motor *m);
double motor_magnetic_energy_j(const struct motor *m);
/* Kinetic energy, the twisted shaft's and the cogging's. */
double motor_mechanical_energy_j(const struct motor *m);

/* Holds the motor's shaft. */
void motor_lock(struct motor *m, bool locked);
/* Somebody drives the shaft at this speed: behind a compliant one, the load. */
void motor_spin(struct motor *m, double speed_rad_s);
void motor_release(struct motor *m);
/* Turns of one phase shorted, a fraction of them over a resistance. */
void motor_short_winding(struct motor *m, int phase, double fraction, double r_ohm);
void motor_mend_winding(struct motor *m);

#endif
