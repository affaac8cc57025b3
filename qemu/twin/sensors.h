/* SPDX-License-Identifier: GPL-2.0-or-later */
/* From the true currents and bus voltage to the codes of a 12-bit converter, and from the shaft to encoder counts. */
#ifndef TWIN_SENSORS_H
#define TWIN_SENSORS_H

#include <stdbool.h>
#include <stdint.h>

#include "keys.h"
#include "random.h"

struct sensor_params {
    double i_range_a; /* at 2048 codes from the middle */
    double v_range_v; /* at code 4096 */
    double adc_bits;
    double adc_conversion_s;
    double i_noise_lsb, v_noise_lsb; /* standard deviation */
    double i_offset_a_lsb, i_offset_b_lsb, i_offset_c_lsb;
    double i_gain_a, i_gain_b, i_gain_c;
    double encoder_counts; /* edges of A and B in a turn */
    double index_angle_rad;
};

extern const struct config_key sensor_keys[];

struct current_sensor {
    double gain;
    double offset_lsb;
    double add_a;
    int stuck_code; /* negative: not stuck */
};

struct sensors {
    struct sensor_params p;
    struct current_sensor current[3];
    struct random noise;
};

void sensors_init(struct sensors *s, const struct sensor_params *p, uint64_t seed);
/* Codes of the three currents and of the bus voltage, with one draw of noise each. */
void sensors_sample(struct sensors *s, const double i_a[3], double bus_v, uint32_t code[4]);

/* Edges of A and B since angle 0, and the count within a turn at which the index pulse stands. */
int64_t sensors_encoder_edges(const struct sensors *s, double theta_rad);
int64_t sensors_index_edge(const struct sensors *s);

#endif
