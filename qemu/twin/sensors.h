/* SPDX-License-Identifier: GPL-2.0-or-later */
/* From the true currents and bus voltage to the codes of a 12-bit converter. What it makes of the current x at the
 * amplifier's input, in codes from the middle:
 *
 *   ((lowpass(x) + sine) gain (1 + w gain_drift t) + added) 2048 / range + offset + w offset_drift t + ringing
 *       + noise + edge noise exp(-t_e / tau),  t_e since the last edge of any leg
 *
 * The amplifiers drift apart: w is 1 for A, -1 for B, 0 for C; what all three have in common would cancel in the
 * transform to two axes. */
#ifndef TWIN_SENSORS_H
#define TWIN_SENSORS_H

#include <stdbool.h>
#include <stdint.h>

#include "amplifier.h"
#include "disc.h"
#include "hall.h"
#include "random.h"
#include "sensor_keys.h"

struct current_sensor {
    double gain;
    double offset_lsb;
    double add_a;
    int stuck_code; /* negative: not stuck */
    struct amplifier amplifier;
    double noise_lsb, edge_noise_lsb; /* drawn for the present conversion; the latter right after an edge */
};

/* A current along a stationary electrical direction that all three amplifiers see beside their own, shunts too while
 * their low sides are off. */
struct injection {
    double amplitude_a; /* 0: none */
    double hz;
    double angle_rad;
    double start_s;
};

struct sensors {
    struct sensor_params p;
    int shows[3]; /* the leg whose current each channel carries: another's if their lines are exchanged */
    struct current_sensor current[3];
    struct injection sine;
    struct disc disc;
    struct hall hall;
    struct random noise, edge_noise;
    double bus_noise_lsb;
    double lag_s;        /* of the amplifiers */
    double step_s, left; /* of the last step, and what it left of a difference between their ends */
    bool follows;        /* the legs matter between two samples, too */
};

void sensors_init(struct sensors *s, const struct sensor_params *p, uint64_t seed);

/* The legs as they were for the last dt_s; needed only if `follows`. */
void sensors_follow(struct sensors *s, const struct leg_view leg[3], double dt_s);

/* A conversion: once the noise, at its trigger, then each channel at its time. */
void sensors_draw_noise(struct sensors *s);
/* input_a: the current at the amplifier's input now. */
uint32_t sensors_current_code(const struct sensors *s, int k, double t_s, double input_a);
/* The same for a modulator, in full scales: nothing of a converter, no edges and no ringing. */
double sensors_current_share(const struct sensors *s, int k, double t_s, double input_a);
uint32_t sensors_bus_code(const struct sensors *s, double bus_v);

/* From start_s on, sin(2 pi hz (t - start_s)) times the amplitude; the sine before it ends. */
void sensors_inject(struct sensors *s, double amplitude_a, double hz, double angle_rad, double start_s);

#endif
