/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a configuration file says of the machine and of what hangs on its shaft. SI units, peak values of one phase.
 * Left out, a key has the value that takes its effect away. */
#ifndef TWIN_MOTOR_PARAMS_H
#define TWIN_MOTOR_PARAMS_H

#include "keys.h"

#define SLOT_ORDERS 4 /* 6, 12, 18, 36 an electrical turn */
#define SLOT_FORMS  6 /* slots.h */

#define REFERENCE_C 25.0 /* temperature at which data sheets state resistance and flux */

struct motor_params {
    double pole_pairs;
    double resistance_ohm; /* of one phase, at 25 degrees */
    double ld_h;
    double lq_h;
    double flux_wb; /* peak flux linkage of one phase, at 25 degrees */

    /* With sat_a_d0 these replace ld_h, lq_h and flux_wb; motor_map.h has the equations. */
    double sat_a_d0, sat_a_dd, sat_s;
    double sat_a_q0, sat_a_qq, sat_t;
    double sat_a_dq, sat_u, sat_v;
    double sat_a_b, sat_a_bp, sat_w, sat_k_q, sat_psi_n_wb;
    double sat_i_f_a;

    double emf_5, emf_7, emf_11, emf_13, emf_17, emf_19; /* shares of the EMF's fundamental, signed */
    double permeance_6, permeance_12;                    /* by which the inverse inductances vary, relative */
    /* slots.h, which takes them as one table */
    double slots6_xx, slots6_qq, slots6_xqq, slots6_q4, slots6_xq, slots6_q3;
    double slots12_xx, slots12_qq, slots12_xqq, slots12_q4, slots12_xq, slots12_q3;
    double slots18_xx, slots18_qq, slots18_xqq, slots18_q4, slots18_xq, slots18_q3;
    double slots36_xx, slots36_qq, slots36_xqq, slots36_q4, slots36_xq, slots36_q3;
    double cogging_nm, cogging_per_rev, cogging_rad; /* peak; torque is -nm sin(per_rev angle + rad) */
    double cogging2_nm, cogging2_per_rev, cogging2_rad;
    double cogging3_nm, cogging3_per_rev, cogging3_rad;
    double iron_hysteresis_nm; /* drag at the open-circuit flux; of a machine without magnets, at 1 Wb */
    double iron_eddy_nms;
    double iron_hysteresis_power, iron_hysteresis_rad_s; /* its drag rises so with speed, and is as above at that one */
    double iron_flux_power;                              /* and with this power of the flux linkage; 0: its square */
    double iron_teeth_per_a; /* what i_d drives through the teeth beside it: share of the loss without current */

    double inertia_kgm2;
    double friction_coulomb_nm;
    double friction_viscous_nms;

    double copper_tempco_per_k;
    double magnet_tempco_per_k;
    double magnet_share;           /* of the winding's rise that the magnets share */
    double thermal_resistance_k_w; /* winding to ambient */
    double thermal_capacity_j_k;   /* of the whole motor */
    double winding_resistance_k_w; /* winding to housing, a part of the resistance */
    double winding_capacity_j_k;   /* a part of the capacity; 0: winding and housing are one */
    double ambient_c;
    double winding_rise_k;     /* above ambient, to begin with */
    double temperature_sensor; /* 1: there is one in the winding (thermometer.h) */
    double temperature_offset_k;
    double temperature_lag_s;
    double initial_angle_rad;
};

struct load_params {
    double inertia_kgm2;
    double viscous_nms;
    double stiffness_nm_rad; /* of the shaft between motor and load; 0: rigid */
    double damping_nms;      /* of that shaft */
    double fan_nms2;         /* torque over the square of the speed */
    double coulomb_nm;
    double stiction_nm;    /* to break away; below coulomb_nm it is that */
    double stribeck_rad_s; /* speed at which half the difference of the two is gone */
};

extern const struct config_key motor_keys[];
extern const struct config_key load_keys[];

/* What no table of ranges can say. NULL, or what is wrong; i_max_a is how far the map has to be usable, 0 if unknown. */
const char *motor_params_check(const struct motor_params *p, const struct load_params *load, double i_max_a);

#endif
