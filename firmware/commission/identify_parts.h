/* SPDX-License-Identifier: MIT */
/* Shared by the steps of identify only. */
#ifndef FIRMWARE_COMMISSION_IDENTIFY_PARTS_H
#define FIRMWARE_COMMISSION_IDENTIFY_PARTS_H

#include "firmware/commission/identify.h"
#include "firmware/settings/scale.h"

/*
 * The halves of each step. Measure, each millisecond: true when complete. Slow loop. Evaluate: NO_REASON if the next step can
 * begin, or the reason for refusing all that is not known yet. Thread.
 */
#define IDENTIFY_HALVES_OF(NAME, name, ...) \
    bool identify_measure_##name(struct identify *d, const struct measure_io *io); \
    enum identify_reason identify_evaluate_##name(struct identify *d);
IDENTIFY_SCRIPT(IDENTIFY_HALVES_OF)

/* A millisecond of the present step. Slow loop. */
bool identify_measure(struct identify *d, const struct measure_io *io);

/* ---- for measuring: slow loop (identify_turn.c) ---- */

/* Enters a phase of the step; its milliseconds count from 1. */
static inline void identify_enter(struct identify *d, uint32_t phase)
{
    d->phase = phase;
    d->phase_ms = 0;
}

/* Tenths of the rated current. */
static inline int32_t identify_tenths_q15(const struct identify *d, int32_t tenths)
{
    return d->i_rated_q15 * tenths / 10;
}

/* The largest current for turning the rotor; the rest is left to the loops. */
static inline int32_t identify_i_max_q15(const struct identify *d)
{
    return identify_tenths_q15(d, 8);
}

/* Plays d->burst along an angle, on top of a current in this frame. */
void identify_play(struct identify *d, const struct measure_io *io, uint32_t field_q32, uint32_t angle_q32);

/* Adjusts the encoder's offset until the EMF is in q only, in some 64 ms; no effect below 1/64 of the bus. */
void identify_correct_offset(const struct identify *d, const struct measure_io *io);

/* Brings the rotor to rest; true when reached, or after `patience_ms`. */
bool identify_stop_rotor(const struct identify *d, const struct measure_io *io, uint32_t patience_ms);

/* ---- results: thread (identify_numbers.c) ---- */

void identify_set(struct identify *d, enum identify_quantity what, int64_t value, int64_t interval);
void identify_set_exact(struct identify *d, enum identify_quantity what, int32_t value);
void identify_refuse(struct identify *d, enum identify_quantity from, enum identify_quantity to,
                     enum identify_reason reason);

/* Refuses all that are not known yet. */
void identify_refuse_rest(struct identify *d, enum identify_reason reason);

/* ---- numbers: thread (identify_numbers.c) ---- */

static inline int64_t identify_size(int64_t x)
{
    return x < 0 ? -x : x;
}

/* From 1 to `most`. */
int32_t identify_within(int64_t value, int64_t most);

/* a b / c, rounded to nearest, halves away from 0; c > 0. */
int64_t identify_scaled(int64_t a, int64_t b, int64_t c);

static inline int64_t identify_permille(int64_t a, int64_t permille)
{
    return scale(identify_size(a), permille, 1000);
}

/* Largest integer whose square is not above n >= 0. */
int64_t identify_root(int64_t n);

/* 2 sqrt(s^2 + a^2 / 3 + b^2 / 3). */
int64_t identify_interval(int64_t s, int64_t a, int64_t b);

/* The mean of 2 to 16 values, and its standard deviation for the interval: times Student's t for 95 %, over 2. */
struct identify_spread {
    int64_t mean, deviation;
};
struct identify_spread identify_spread(const int64_t of[], int32_t count);

/* True if the deviation is a tenth of the mean or more. */
static inline bool identify_scatters(const struct identify_spread *s)
{
    return s->deviation * 10 > s->mean;
}

/*
 * -ln(1 - y) in Q30, 0 <= y < 1 in Q30, to 1e-7: with y = 1 - exp(-x), x. ln(1 - y) = -2 (z + z^3 / 3 + z^5 / 5 + ...),
 * z = y / (2 - y).
 */
int64_t identify_log_q30(int64_t y_q30);

/* ---- units: thread (identify_numbers.c) ---- */

int64_t identify_nv(const struct identify *d, int64_t v_sum_q15, int64_t count);
int64_t identify_ua(const struct identify *d, int64_t i_sum_q15, int64_t count);
int64_t identify_mrad_s(int64_t rpm_q15_sum, int64_t count); /* of the shaft */
int64_t identify_torque_nnm(const struct identify *d, int64_t flux_e1_uwb, int64_t i_ua);

/* uV of a wave's height, at the mean of these bursts; and nA of a change of current in 256ths of Q15. */
int64_t identify_wave_uv(const struct identify *d, const struct burst_sums *s);
int64_t identify_change_na(const struct identify *d, int64_t change_256ths);

/* Slope of a run's speed, mrad/s^2 of the shaft; of all these runs' voltage over speed: flux, 0.1 uWb. 0: too few samples. */
int64_t identify_slope_mrad_s2(const struct measure_run *r);
int64_t identify_flux_of_runs(const struct identify *d, const struct measure_run *const runs[], int32_t count);

/* Uncertainty of that slope from nonlinearity: an oscillating coupling, changing friction. */
int64_t identify_bent_permille(const struct measure_run *r);

/* Inertia from accelerations by two currents, gmm2; 0: they do not differ, or a run has too few samples. */
int64_t identify_inertia_gmm2(const struct identify *d, int64_t flux_e1_uwb, const struct measure_run *a,
                              const struct measure_run *b);

/* True if the response along one axis is twice that across it. */
bool identify_doubled(const struct measure_axes *m);

/* Inductance seen by a wave, nH, without cross-coupling; 0: no current response. */
int64_t identify_inductance_nh(const struct identify *d, const struct burst_sums *s);

/* Sets the result from two halves, or refuses it; `bound`: additional systematic errors. */
void identify_know_inductance(struct identify *d, enum identify_quantity what, const int64_t halves[2], int64_t bound);

/* ---- tuning: thread (identify_numbers.c) ---- */

/* Replaces all motor parameters by neutral values. */
void identify_reset_motor(struct params *p);

/* Gains for the params known by now and a crossover of `hz`; clamps what does not fit. NO_REASON or STOPPED. */
enum identify_reason identify_tune(struct identify *d, int32_t hz);

/* The same for a turning rotor: both currents and the speed are regulated. NO_REASON, or `otherwise`. */
enum identify_reason identify_tune_turning(struct identify *d, enum identify_reason otherwise);

/* Puts the same tuning into effect again, in a corrected frame. */
void identify_replace(struct identify *d);

#endif
