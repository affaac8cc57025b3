/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "sensors.h"

#include <math.h>
#include <string.h>

#define CODES    4096
#define MIDDLE   2048
#define TURN_RAD 6.283185307179586

#define KEY(field, lo, hi, init) \
    { \
#field, offsetof(struct sensor_params, field), lo, hi, init \
    }
const struct config_key sensor_keys[] = {
    KEY(i_range_a, 1e-3, 1e5, CONFIG_REQUIRED),
    KEY(v_range_v, 1e-3, 1e5, CONFIG_REQUIRED),
    KEY(adc_bits, 6, 12, 12),
    KEY(adc_conversion_s, 1e-8, 2e-6, 1.5e-6),
    KEY(i_noise_lsb, 0, 1000, 0),
    KEY(v_noise_lsb, 0, 1000, 0),
    KEY(i_offset_a_lsb, -CODES, CODES, 0),
    KEY(i_offset_b_lsb, -CODES, CODES, 0),
    KEY(i_offset_c_lsb, -CODES, CODES, 0),
    KEY(i_gain_a, -10, 10, 1),
    KEY(i_gain_b, -10, 10, 1),
    KEY(i_gain_c, -10, 10, 1),
    KEY(encoder_counts, 4, 1e6, 4096),
    KEY(index_angle_rad, -1e6, 1e6, 0),
    CONFIG_KEYS_END,
};
#undef KEY

void sensors_init(struct sensors *s, const struct sensor_params *p, uint64_t seed)
{
    memset(s, 0, sizeof *s);
    s->p = *p;
    s->current[0] = (struct current_sensor){p->i_gain_a, p->i_offset_a_lsb, 0, -1};
    s->current[1] = (struct current_sensor){p->i_gain_b, p->i_offset_b_lsb, 0, -1};
    s->current[2] = (struct current_sensor){p->i_gain_c, p->i_offset_c_lsb, 0, -1};
    random_seed(&s->noise, seed);
}

/* Rounds to the converter's step and clips; a converter of fewer bits leaves the low ones zero. */
static uint32_t quantise(const struct sensors *s, double code)
{
    double step = exp2(12 - s->p.adc_bits);
    double whole = floor(code / step + 0.5) * step;
    return (uint32_t)fmin(fmax(whole, 0), CODES - step);
}

void sensors_sample(struct sensors *s, const double i_a[3], double bus_v, uint32_t code[4])
{
    for (int k = 0; k < 3; k++) {
        const struct current_sensor *c = &s->current[k];
        double lsb = (i_a[k] * c->gain + c->add_a) / s->p.i_range_a * MIDDLE + c->offset_lsb;
        lsb += s->p.i_noise_lsb * random_gaussian(&s->noise);
        code[k] = c->stuck_code >= 0 ? (uint32_t)c->stuck_code : quantise(s, MIDDLE + lsb);
    }
    double bus_lsb = bus_v / s->p.v_range_v * CODES + s->p.v_noise_lsb * random_gaussian(&s->noise);
    code[3] = quantise(s, bus_lsb);
}

int64_t sensors_encoder_edges(const struct sensors *s, double theta_rad)
{
    return (int64_t)floor(theta_rad / TURN_RAD * s->p.encoder_counts);
}

int64_t sensors_index_edge(const struct sensors *s)
{
    double turn = s->p.index_angle_rad / TURN_RAD;
    return (int64_t)floor((turn - floor(turn)) * s->p.encoder_counts);
}
