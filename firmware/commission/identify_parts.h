/* SPDX-License-Identifier: MIT */
/* What the steps of identify share; nobody else includes this. Each has a part that measures and one that thinks. */
#ifndef FIRMWARE_COMMISSION_IDENTIFY_PARTS_H
#define FIRMWARE_COMMISSION_IDENTIFY_PARTS_H

#include "firmware/commission/identify.h"

/* ---- measuring: slow loop; true when the step has all it wants ---- */

bool identify_measure_pulses(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc);
bool identify_measure_hold(struct identify *d, volatile struct current_loop *c);
bool identify_measure_resistance(struct identify *d, volatile struct current_loop *c);
bool identify_measure_axes(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc);
bool identify_measure_inductance(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc);

/* ---- thinking: thread; true if the next step can begin ---- */

bool identify_think_pulses(struct identify *d);
bool identify_think_hold(struct identify *d);
bool identify_think_resistance(struct identify *d);
bool identify_think_axes(struct identify *d);
bool identify_think_inductance(struct identify *d);

/* ---- results: thread ---- */

void identify_know(struct identify *d, enum identify_quantity what, int64_t value, int64_t interval);
void identify_refuse(struct identify *d, enum identify_quantity what, enum identify_reason reason);

/* 2 sqrt(s^2 + a^2 / 3 + b^2 / 3). Thread. */
int64_t identify_interval(int64_t s, int64_t a, int64_t b);

/* a b / c, rounded to nearest, with the sign of a; b, c > 0. Thread. */
int64_t identify_scaled(int64_t a, int64_t b, int64_t c);

/* Largest integer whose square is not above n >= 0. Thread. */
int64_t identify_root(int64_t n);

/* Gains for the params as they are known by now and a crossover of `hz`; what does not fit is held to what does. Thread. */
bool identify_tune(struct identify *d, int32_t hz);

/*
 * -ln(1 - y) in Q30, 0 <= y < 1 in Q30, to 1e-7: with y = 1 - exp(-x), x. ln(1 - y) = -2 (z + z^3 / 3 + z^5 / 5 + ...),
 * z = y / (2 - y). Thread.
 */
int64_t identify_log_q30(int64_t y_q30);

#endif
