/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "motor_params.h"

#include <stdbool.h>

#include "motor_map.h"

#define KEY(field, lo, hi, init) ((struct config_key){#field, offsetof(struct motor_params, field), lo, hi, init})
const struct config_key motor_keys[] = {
    KEY(pole_pairs, 1, 100, CONFIG_REQUIRED),
    KEY(resistance_ohm, 1e-4, 1e3, CONFIG_REQUIRED),
    KEY(ld_h, 1e-7, 10, CONFIG_REQUIRED),
    KEY(lq_h, 1e-7, 10, CONFIG_REQUIRED),
    KEY(flux_wb, 0, 10, CONFIG_REQUIRED),
    KEY(sat_a_d0, 0, 1e9, 0),
    KEY(sat_a_dd, 0, 1e30, 0),
    KEY(sat_s, 0, 8, 0),
    KEY(sat_a_q0, 0, 1e9, 0),
    KEY(sat_a_qq, 0, 1e30, 0),
    KEY(sat_t, 0, 8, 0),
    KEY(sat_a_dq, 0, 1e30, 0),
    KEY(sat_u, 0, 8, 0),
    KEY(sat_v, 0, 8, 0),
    KEY(sat_a_b, 0, 1e30, 0),
    KEY(sat_a_bp, 0, 1e30, 0),
    KEY(sat_w, 2, 4, 2),
    KEY(sat_k_q, 0, 100, 0),
    KEY(sat_psi_n_wb, 0, 10, 0),
    KEY(sat_i_f_a, 0, 1e5, 0),
    KEY(emf_5, -0.5, 0.5, 0),
    KEY(emf_7, -0.5, 0.5, 0),
    KEY(emf_11, -0.5, 0.5, 0),
    KEY(emf_13, -0.5, 0.5, 0),
    KEY(emf_17, -0.5, 0.5, 0),
    KEY(emf_19, -0.5, 0.5, 0),
    KEY(permeance_6, -0.4, 0.4, 0),
    KEY(permeance_12, -0.4, 0.4, 0),
    KEY(slots6_xx, -1e6, 1e6, 0),
    KEY(slots6_qq, -1e6, 1e6, 0),
    KEY(slots6_xqq, -1e6, 1e6, 0),
    KEY(slots6_q4, -1e6, 1e6, 0),
    KEY(slots6_xq, -1e6, 1e6, 0),
    KEY(slots6_q3, -1e6, 1e6, 0),
    KEY(slots12_xx, -1e6, 1e6, 0),
    KEY(slots12_qq, -1e6, 1e6, 0),
    KEY(slots12_xqq, -1e6, 1e6, 0),
    KEY(slots12_q4, -1e6, 1e6, 0),
    KEY(slots12_xq, -1e6, 1e6, 0),
    KEY(slots12_q3, -1e6, 1e6, 0),
    KEY(slots18_xx, -1e6, 1e6, 0),
    KEY(slots18_qq, -1e6, 1e6, 0),
    KEY(slots18_xqq, -1e6, 1e6, 0),
    KEY(slots18_q4, -1e6, 1e6, 0),
    KEY(slots18_xq, -1e6, 1e6, 0),
    KEY(slots18_q3, -1e6, 1e6, 0),
    KEY(slots36_xx, -1e6, 1e6, 0),
    KEY(slots36_qq, -1e6, 1e6, 0),
    KEY(slots36_xqq, -1e6, 1e6, 0),
    KEY(slots36_q4, -1e6, 1e6, 0),
    KEY(slots36_xq, -1e6, 1e6, 0),
    KEY(slots36_q3, -1e6, 1e6, 0),
    KEY(cogging_nm, 0, 1e3, 0),
    KEY(cogging_per_rev, 0, 1e4, 0),
    KEY(cogging_rad, -1e3, 1e3, 0),
    KEY(cogging2_nm, 0, 1e3, 0),
    KEY(cogging2_per_rev, 0, 1e4, 0),
    KEY(cogging2_rad, -1e3, 1e3, 0),
    KEY(cogging3_nm, 0, 1e3, 0),
    KEY(cogging3_per_rev, 0, 1e4, 0),
    KEY(cogging3_rad, -1e3, 1e3, 0),
    KEY(iron_hysteresis_nm, 0, 1e3, 0),
    KEY(iron_eddy_nms, 0, 1e3, 0),
    KEY(iron_hysteresis_power, 0, 1, 0),
    KEY(iron_hysteresis_rad_s, 1e-3, 1e5, 1),
    KEY(iron_flux_power, 0, 2, 0),
    KEY(iron_teeth_per_a, 0, 10, 0),
    KEY(inertia_kgm2, 1e-10, 1e3, CONFIG_REQUIRED),
    KEY(friction_coulomb_nm, 0, 1e3, 0),
    KEY(friction_viscous_nms, 0, 1e3, 0),
    KEY(copper_tempco_per_k, 0, 0.1, 0.0039),
    KEY(magnet_tempco_per_k, -0.01, 0, 0),
    KEY(magnet_share, 0, 1, 0.5),
    KEY(thermal_resistance_k_w, 1e-3, 1e4, 5),
    KEY(thermal_capacity_j_k, 1e-2, 1e6, 50),
    KEY(winding_resistance_k_w, 0, 1e4, 0),
    KEY(winding_capacity_j_k, 0, 1e6, 0),
    KEY(ambient_c, -60, 200, REFERENCE_C),
    KEY(winding_rise_k, -100, 200, 0),
    KEY(temperature_sensor, 0, 1, 1),
    KEY(temperature_offset_k, -50, 50, 0),
    KEY(temperature_lag_s, 1e-3, 1e3, 2),
    KEY(initial_angle_rad, -1e6, 1e6, 0),
    CONFIG_KEYS_END,
};
#undef KEY
#define KEY(field, lo, hi, init) ((struct config_key){#field, offsetof(struct load_params, field), lo, hi, init})
const struct config_key load_keys[] = {
    KEY(inertia_kgm2, 0, 1e3, 0), KEY(viscous_nms, 0, 1e3, 0),       KEY(stiffness_nm_rad, 0, 1e8, 0),
    KEY(damping_nms, 0, 1e3, 0),  KEY(fan_nms2, 0, 1e3, 0),          KEY(coulomb_nm, 0, 1e3, 0),
    KEY(stiction_nm, 0, 1e3, 0),  KEY(stribeck_rad_s, 1e-3, 1e4, 1), CONFIG_KEYS_END,
};
#undef KEY

static bool whole(double value)
{
    return value == floor(value);
}

static const char *check_heat(const struct motor_params *p)
{
    if ((p->winding_capacity_j_k > 0) != (p->winding_resistance_k_w > 0)) {
        return "motor.winding_capacity_j_k and winding_resistance_k_w go together";
    }
    if (p->winding_capacity_j_k >= p->thermal_capacity_j_k || p->winding_resistance_k_w >= p->thermal_resistance_k_w) {
        return p->winding_capacity_j_k > 0 ? "motor.winding_* is less than motor.thermal_*, of which it is a part"
                                           : NULL;
    }
    return NULL;
}

static const char *check_map(const struct motor_params *p, double i_max_a)
{
    if (p->sat_a_q0 == 0) {
        return "motor.sat_a_d0 needs motor.sat_a_q0 beside it";
    }
    if (!whole(p->sat_s) || !whole(p->sat_t) || !whole(p->sat_u) || !whole(p->sat_v)) {
        return "motor.sat_s, sat_t, sat_u and sat_v are whole numbers";
    }
    if (p->sat_w != 2 && p->sat_w != 4) {
        return "motor.sat_w is 2 or 4";
    }
    struct motor_map map;
    motor_map_init(&map, p);
    if (!motor_map_monotone(&map, i_max_a)) {
        return "motor.sat_*: an inductance turns negative within the range of the currents";
    }
    return NULL;
}

const char *motor_params_check(const struct motor_params *p, const struct load_params *load, double i_max_a)
{
    if (!whole(p->pole_pairs)) {
        return "motor.pole_pairs is a whole number";
    }
    if (!whole(p->temperature_sensor)) {
        return "motor.temperature_sensor is 0 or 1";
    }
    const char *heat = check_heat(p);
    if (heat) {
        return heat;
    }
    if (!whole(p->cogging_per_rev) || !whole(p->cogging2_per_rev) || !whole(p->cogging3_per_rev)) {
        return "motor.cogging_per_rev, cogging2_per_rev and cogging3_per_rev are whole numbers";
    }
    if (load->stiffness_nm_rad > 0 && load->inertia_kgm2 == 0) {
        return "load.stiffness_nm_rad needs load.inertia_kgm2 behind it";
    }
    return p->sat_a_d0 > 0 ? check_map(p, i_max_a) : NULL;
}
