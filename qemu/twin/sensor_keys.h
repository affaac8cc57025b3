/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Parameters of everything that measures. At its default each error is absent. */
#ifndef TWIN_SENSOR_KEYS_H
#define TWIN_SENSOR_KEYS_H

#include "keys.h"

struct sensor_params {
    /* converter */
    double i_range_a; /* at 2048 codes from the middle */
    double v_range_v; /* at code 4096 */
    double adc_bits;
    double adc_conversion_s;
    double skew_b_s, skew_c_s;       /* B and C are sampled that much later than A and the bus */
    double i_noise_lsb, v_noise_lsb; /* standard deviation */

    /* isolated modulators (bit_streams.h) in place of a converter for the currents */
    double modulators;      /* 1: there are */
    double modulator_noise; /* at each bit, rms, in full scales */

    /* current sensors (sensors.h, amplifier.h) */
    double i_offset_a_lsb, i_offset_b_lsb, i_offset_c_lsb;
    double i_gain_a, i_gain_b, i_gain_c;
    double i_offset_drift_lsb_s, i_gain_drift_per_s;
    double shunt;  /* 1: below the low side; 0: in line with the phase */
    double amp_hz; /* bandwidth, 0: ideal */
    double ring_lsb, ring_hz, ring_tau_s;
    double edge_noise_lsb, edge_noise_tau_s;

    /* encoder (disc.h) */
    double encoder_counts; /* edges of A and B in a turn */
    double index_angle_rad;
    double encoder_index_counts; /* width of the index pulse */
    double encoder_asymmetry, encoder_phase;
    double encoder_ecc_rad, encoder_ecc_phase_rad;
    double encoder_lost_per_rev, encoder_extra_per_rev;

    /* Hall sensors (hall.h) */
    double hall_angle_rad;
    double hall_error_a_rad, hall_error_b_rad, hall_error_c_rad;
    double hall_hysteresis_rad;
};

extern const struct config_key sensor_keys[];

/* NULL, or what is wrong with parameters that are each within their own range. */
const char *sensor_conflict(const struct sensor_params *p);

#endif
