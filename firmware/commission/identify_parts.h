/* SPDX-License-Identifier: MIT */
/* Shared by the steps of identify only. Each step has a part that measures and one that thinks. */
#ifndef FIRMWARE_COMMISSION_IDENTIFY_PARTS_H
#define FIRMWARE_COMMISSION_IDENTIFY_PARTS_H

#include "firmware/commission/identify.h"

/* ---- measuring: slow loop; true when the step has all it needs ---- */

bool identify_measure_pulses(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc);
bool identify_measure_hold(struct identify *d, volatile struct current_loop *c);
bool identify_measure_resistance(struct identify *d, volatile struct current_loop *c);
bool identify_measure_axes(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc);
bool identify_measure_inductance(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc);

/* turning */
bool identify_measure_turn(struct identify *d, const struct identify_io *io);
bool identify_measure_push(struct identify *d, const struct identify_io *io);
bool identify_measure_index(struct identify *d, const struct identify_io *io);
bool identify_measure_speeds(struct identify *d, const struct identify_io *io);
bool identify_measure_ramps(struct identify *d, const struct identify_io *io);
bool identify_measure_map(struct identify *d, const struct identify_io *io);

/* ---- for the turning steps (identify_rotor.c): slow loop ---- */

/* EMF in q, from the last sample, Q15. */
int32_t identify_emf_q15(const struct identify_io *io);

/* Moves the encoder's offset until the EMF is all in q, in some 64 ms; does nothing below a 64th of the bus. */
void identify_correct_offset(const struct identify *d, const struct identify_io *io);

/* Regulates the speed by a q current up to this limit; the loop owns the references from now on. */
void identify_control_speed(const struct identify_io *io, int32_t target_rpm, int32_t i_most_q15);

/* Applies a current across the magnets. */
void identify_push(const struct identify_io *io, int32_t i_q_q15);

/* Adds the last sample only: no sum overflows within 4096 samples. */
void identify_run_add(struct identify_run *r, const struct identify_io *io);
void identify_run_add_v(struct identify_run *r, const struct identify_io *io, int32_t v_q15); /* another voltage */

/* The largest current for turning the rotor; the rest is left to the loops. */
int32_t identify_i_most_q15(const struct identify *d);

/* ---- thinking: thread; true if the next step can begin ---- */

bool identify_think_pulses(struct identify *d);
bool identify_think_hold(struct identify *d);
bool identify_think_resistance(struct identify *d);
bool identify_think_axes(struct identify *d);
bool identify_think_inductance(struct identify *d);
bool identify_think_turn(struct identify *d);
bool identify_think_push(struct identify *d);
bool identify_think_index(struct identify *d);
bool identify_think_speeds(struct identify *d);
bool identify_think_ramps(struct identify *d);
bool identify_think_map(struct identify *d);

/* ---- results: thread ---- */

void identify_know(struct identify *d, enum identify_quantity what, int64_t value, int64_t interval);
void identify_know_exactly(struct identify *d, enum identify_quantity what, int32_t value);
void identify_refuse(struct identify *d, enum identify_quantity what, enum identify_reason reason);

/* Refuses all from `first` to the last that are not known yet. */
void identify_refuse_rest(struct identify *d, enum identify_quantity first, enum identify_reason reason);

/* ---- units: thread (identify_units.c) ---- */

/* Slope of a run's speed, mrad/s^2 of the shaft; of all these runs' voltage over speed: flux, 0.1 uWb. 0: too few samples. */
int64_t identify_slope_mrad_s2(const struct identify_run *r);
int64_t identify_flux_of_runs(const struct identify *d, const struct identify_run *const runs[], int32_t count);

/* Inertia from accelerations by two currents, gmm2; 0: they do not differ. */
int64_t identify_inertia_gmm2(const struct identify *d, int64_t flux_e1_uwb, const struct identify_run *a,
                              const struct identify_run *b);

int64_t identify_nv(const struct identify *d, int64_t v_sum_q15, int64_t count);
int64_t identify_ua(const struct identify *d, int64_t i_sum_q15, int64_t count);
int64_t identify_mrad_s(int64_t rpm_q15_sum, int64_t count); /* of the shaft */
int64_t identify_torque_nnm(const struct identify *d, int64_t flux_e1_uwb, int64_t i_ua);

/* Adds the current response along an angle and across it: see saliency.h. */
void identify_axes_add(struct identify_axes_sums *s, uint32_t angle_q32, int32_t along, int32_t across);

/* True if the response along one axis is twice that across it. */
bool identify_doubled(const struct identify_axes_sums *m);

/* Inductance seen by a wave, nH, as if it were alone; 0: no current response. */
int64_t identify_inductance_nh(const struct identify *d, const struct burst_sums *s);

/* Sets the result from two halves, or refuses it; `bound`: errors that not every inductance's interval has. */
void identify_know_inductance(struct identify *d, enum identify_quantity what, const int64_t halves[2], int64_t bound);

/* ---- tuning: thread ---- */

/* Replaces all that is not the inverter's by values that nothing depends on. */
void identify_forget_motor(struct params *p);

/* As identify_tune(), for a turning rotor, from what is known of the motor: both currents and the speed are regulated. */
bool identify_tune_turning(struct identify *d);

/* Puts the same tuning into effect again, in a corrected frame. */
void identify_retake(struct identify *d);

/* 2 sqrt(s^2 + a^2 / 3 + b^2 / 3). Thread. */
int64_t identify_interval(int64_t s, int64_t a, int64_t b);

/* a b / c, rounded to nearest, with the sign of a; b, c > 0. Thread. */
int64_t identify_scaled(int64_t a, int64_t b, int64_t c);

/* The mean of 2 to 16 values, and its standard deviation for the interval: times Student's t for 95 %, over 2. */
struct identify_spread {
    int64_t mean, deviation;
};
struct identify_spread identify_spread(const int64_t of[], int32_t count);

/* Largest integer whose square is not above n >= 0. Thread. */
int64_t identify_root(int64_t n);

/* Gains for the params known by now and a crossover of `hz`; clamps what does not fit. Thread. */
bool identify_tune(struct identify *d, int32_t hz);

/*
 * -ln(1 - y) in Q30, 0 <= y < 1 in Q30, to 1e-7: with y = 1 - exp(-x), x. ln(1 - y) = -2 (z + z^3 / 3 + z^5 / 5 + ...),
 * z = y / (2 - y). Thread.
 */
int64_t identify_log_q30(int64_t y_q30);

#endif
