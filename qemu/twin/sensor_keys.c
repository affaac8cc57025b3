/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "sensor_keys.h"

#include <stdbool.h>

#define CODES 4096

#define KEY(field, lo, hi, init) ((struct config_key){#field, offsetof(struct sensor_params, field), lo, hi, init})
const struct config_key sensor_keys[] = {
    KEY(i_range_a, 1e-3, 1e5, CONFIG_REQUIRED),
    KEY(v_range_v, 1e-3, 1e5, CONFIG_REQUIRED),
    KEY(adc_bits, 6, 12, 12),
    KEY(adc_conversion_s, 1e-8, 2e-6, 4e-7),
    KEY(skew_b_s, 0, 2e-6, 0),
    KEY(skew_c_s, 0, 2e-6, 0),
    KEY(i_noise_lsb, 0, 1000, 0),
    KEY(v_noise_lsb, 0, 1000, 0),
    KEY(modulators, 0, 1, 0),
    KEY(modulator_noise, 0, 0.1, 0),
    KEY(i_offset_a_lsb, -CODES, CODES, 0),
    KEY(i_offset_b_lsb, -CODES, CODES, 0),
    KEY(i_offset_c_lsb, -CODES, CODES, 0),
    KEY(i_gain_a, -10, 10, 1),
    KEY(i_gain_b, -10, 10, 1),
    KEY(i_gain_c, -10, 10, 1),
    KEY(i_offset_drift_lsb_s, -1e4, 1e4, 0),
    KEY(i_gain_drift_per_s, -10, 10, 0),
    KEY(shunt, 0, 1, 0),
    KEY(amp_hz, 0, 1e9, 0),
    KEY(ring_lsb, -CODES, CODES, 0),
    KEY(ring_hz, 0, 1e9, 0),
    KEY(ring_tau_s, 1e-9, 1e-3, 1e-7),
    KEY(edge_noise_lsb, 0, CODES, 0),
    KEY(edge_noise_tau_s, 1e-9, 1e-3, 1e-7),
    KEY(encoder_counts, 4, 1e6, 4096),
    KEY(index_angle_rad, -1e6, 1e6, 0),
    KEY(encoder_index_counts, 1, 1e5, 1),
    KEY(encoder_asymmetry, -0.125, 0.125, 0),
    KEY(encoder_phase, -0.25, 0.25, 0),
    KEY(encoder_ecc_rad, 0, 0.1, 0),
    KEY(encoder_ecc_phase_rad, -1e6, 1e6, 0),
    KEY(encoder_lost_per_rev, 0, 1e6, 0),
    KEY(encoder_extra_per_rev, 0, 1e6, 0),
    KEY(hall_angle_rad, -1e6, 1e6, 0),
    KEY(hall_error_a_rad, -0.5, 0.5, 0),
    KEY(hall_error_b_rad, -0.5, 0.5, 0),
    KEY(hall_error_c_rad, -0.5, 0.5, 0),
    KEY(hall_hysteresis_rad, 0, 0.4, 0),
    CONFIG_KEYS_END,
};
#undef KEY

static bool whole(double value)
{
    return value == floor(value);
}

static const char *converter_conflict(const struct sensor_params *p)
{
    if (!whole(p->adc_bits)) {
        return "sensor.adc_bits is a whole number";
    }
    if (!whole(p->shunt)) {
        return "sensor.shunt is 0 or 1";
    }
    if (!whole(p->modulators)) {
        return "sensor.modulators is 0 or 1";
    }
    if (p->modulators != 0 && p->shunt != 0) {
        return "sensor.modulators are in line with the phases: sensor.shunt is 0";
    }
    if (fmax(p->skew_b_s, p->skew_c_s) >= p->adc_conversion_s) {
        return "sensor.skew_b_s and sensor.skew_c_s are less than sensor.adc_conversion_s";
    }
    if (p->amp_hz > 0 && p->amp_hz < 1000) {
        return "sensor.amp_hz is 0 (ideal) or at least 1000";
    }
    return NULL;
}

static const char *encoder_conflict(const struct sensor_params *p)
{
    bool displaced = p->encoder_asymmetry != 0 || p->encoder_phase != 0;
    if (!whole(p->encoder_counts) || !whole(p->encoder_index_counts)) {
        return "sensor.encoder_counts and sensor.encoder_index_counts are whole numbers";
    }
    if (p->encoder_index_counts >= p->encoder_counts) {
        return "sensor.encoder_index_counts is less than sensor.encoder_counts";
    }
    if (displaced && !whole(p->encoder_counts / 4)) {
        return "sensor.encoder_counts is a multiple of 4 with sensor.encoder_asymmetry or sensor.encoder_phase";
    }
    if (2 * fabs(p->encoder_asymmetry) + fabs(p->encoder_phase) >= 0.25) {
        return "twice sensor.encoder_asymmetry and sensor.encoder_phase together are less than 0.25: edges keep their "
               "order";
    }
    if (fmax(p->encoder_lost_per_rev, p->encoder_extra_per_rev) > p->encoder_counts) {
        return "sensor.encoder_lost_per_rev and sensor.encoder_extra_per_rev are at most sensor.encoder_counts";
    }
    return NULL;
}

const char *sensor_conflict(const struct sensor_params *p)
{
    const char *conflict = converter_conflict(p);
    return conflict ? conflict : encoder_conflict(p);
}
