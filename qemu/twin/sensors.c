/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "sensors.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "extremes.h"

#define CODES    4096
#define MIDDLE   2048
#define TURN_RAD 6.283185307179586

static const double drift_weight[3] = {1, -1, 0};

void sensors_init(struct sensors *s, const struct sensor_params *p, uint64_t seed)
{
    const double gain[3] = {p->i_gain_a, p->i_gain_b, p->i_gain_c};
    const double offset_lsb[3] = {p->i_offset_a_lsb, p->i_offset_b_lsb, p->i_offset_c_lsb};
    memset(s, 0, sizeof *s);
    s->p = *p;
    for (int k = 0; k < 3; k++) {
        s->shows[k] = k;
        s->current[k] = (struct current_sensor){.gain = gain[k], .offset_lsb = offset_lsb[k], .stuck_code = -1};
        amplifier_init(&s->current[k].amplifier);
    }
    s->lag_s = p->amp_hz > 0 ? 1 / (TURN_RAD * p->amp_hz) : 0;
    s->follows = p->amp_hz > 0 || p->ring_lsb != 0 || p->edge_noise_lsb > 0;
    disc_init(&s->disc, p, seed);
    hall_init(&s->hall, p);
    random_seed(&s->noise, seed);
    random_seed_stream(&s->edge_noise, seed, STREAM_EDGE_NOISE);
}

void sensors_follow(struct sensors *s, const struct leg_view leg[3], double dt_s)
{
    if (dt_s != s->step_s) { /* most steps are as long as the one before */
        s->step_s = dt_s;
        s->left = s->lag_s > 0 ? exp(-dt_s / s->lag_s) : 0;
    }
    for (int k = 0; k < 3; k++) {
        amplifier_follow(&s->current[k].amplifier, &leg[k], dt_s, s->lag_s, s->left);
    }
}

/* ---- one conversion ---- */

void sensors_draw_noise(struct sensors *s)
{
    for (int k = 0; k < 3; k++) {
        s->current[k].noise_lsb = s->p.i_noise_lsb * random_gaussian(&s->noise);
    }
    for (int k = 0; k < 3 && s->p.edge_noise_lsb > 0; k++) {
        s->current[k].edge_noise_lsb = s->p.edge_noise_lsb * random_gaussian(&s->edge_noise);
    }
    s->bus_noise_lsb = s->p.v_noise_lsb * random_gaussian(&s->noise);
}

/* The low pass has answered the sine from rest since its start. */
static double injected_a(const struct sensors *s, int k, double t_s)
{
    const struct injection *i = &s->sine;
    if (i->amplitude_a == 0) {
        return 0;
    }
    double phase_rad = TURN_RAD * i->hz * (t_s - i->start_s), lag_rad = TURN_RAD * i->hz * s->lag_s;
    double settling = s->lag_s > 0 ? lag_rad * exp(-(t_s - i->start_s) / s->lag_s) : 0;
    double shape = (sin(phase_rad) - lag_rad * cos(phase_rad) + settling) / (1 + lag_rad * lag_rad);
    return i->amplitude_a * shape * cos(i->angle_rad - k * TURN_RAD / 3);
}

static double edge_noise_lsb(const struct sensors *s, int k)
{
    if (s->p.edge_noise_lsb == 0) {
        return 0;
    }
    double since_s = LONG_AGO_S;
    for (int leg = 0; leg < 3; leg++) {
        since_s = lesser(since_s, s->current[leg].amplifier.since_edge_s);
    }
    return s->current[k].edge_noise_lsb * exp(-since_s / s->p.edge_noise_tau_s);
}

/*
 * Rounds to the converter's step and clips; a converter of fewer bits leaves the low ones zero. What is not a number would look
 * like the lowest code, and the drive would be blamed for it.
 */
static uint32_t quantise(const struct sensors *s, double code)
{
    if (!isfinite(code)) {
        fprintf(stderr, "twin: a sensor's input is not a number: a bug of the model\n");
        abort();
    }
    double step = exp2(12 - s->p.adc_bits);
    double whole = floor(code / step + 0.5) * step;
    return (uint32_t)lesser(larger(whole, 0), CODES - step);
}

/* From the middle. */
static double amplified_lsb(const struct sensors *s, int k, double t_s, double input_a)
{
    const struct current_sensor *c = &s->current[k];
    double seen_a = (s->lag_s > 0 ? c->amplifier.out_a : input_a) + injected_a(s, k, t_s);
    double gain = c->gain * (1 + drift_weight[k] * s->p.i_gain_drift_per_s * t_s);
    double offset_lsb = c->offset_lsb + drift_weight[k] * s->p.i_offset_drift_lsb_s * t_s;
    return (seen_a * gain + c->add_a) / s->p.i_range_a * MIDDLE + offset_lsb;
}

uint32_t sensors_current_code(const struct sensors *s, int k, double t_s, double input_a)
{
    const struct current_sensor *c = &s->current[k];
    if (c->stuck_code >= 0) {
        return (uint32_t)c->stuck_code;
    }
    double lsb = amplified_lsb(s, k, t_s, input_a);
    lsb += amplifier_ringing_lsb(&c->amplifier, &s->p);
    lsb += c->noise_lsb + edge_noise_lsb(s, k);
    return quantise(s, MIDDLE + lsb);
}

double sensors_current_share(const struct sensors *s, int k, double t_s, double input_a)
{
    int stuck_code = s->current[k].stuck_code;
    return (stuck_code >= 0 ? stuck_code - MIDDLE : amplified_lsb(s, k, t_s, input_a)) / MIDDLE;
}

uint32_t sensors_bus_code(const struct sensors *s, double bus_v)
{
    return quantise(s, bus_v / s->p.v_range_v * CODES + s->bus_noise_lsb);
}

void sensors_inject(struct sensors *s, double amplitude_a, double hz, double angle_rad, double start_s)
{
    s->sine = (struct injection){amplitude_a, hz, angle_rad, start_s};
}
