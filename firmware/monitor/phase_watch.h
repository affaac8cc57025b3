/* SPDX-License-Identifier: MIT */
/* Detects an open phase: it should conduct and does not. */
#ifndef FIRMWARE_MONITOR_PHASE_WATCH_H
#define FIRMWARE_MONITOR_PHASE_WATCH_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

/* For each phase: references that it did not follow. */
struct phase_watch {
    int32_t missing_q15[3];           /* sums, one term every second millisecond */
    int32_t i_d_ref_q15, i_q_ref_q15; /* of the previous millisecond, which the currents have followed since */
    int32_t min_q15;                  /* smallest measurable current */
    int32_t conducted_q15;            /* by all phases, in the last steps */
};

/* Starts, from the parameters. Slow loop, when operation begins. */
void phase_watch_begin(struct axis *a);

/* The references that the currents follow until the phases are checked. Slow loop, in the millisecond before. */
void phase_watch_expect(struct axis *a);

/* Slow loop, every second millisecond. */
void phase_watch_step(struct axis *a);

/*
 * The phase (as in the fault's detail) that has recently stopped conducting: too briefly for a fault of its own, long enough to
 * be the cause of an over-current or a lost speed; 0: none. Any context.
 */
bool phase_watch_suspects(const struct axis *a, int32_t *phase);

/* ==== the sensors' zeros ==== */

/*
 * Detects a drift of a current sensor's zero since `on`: the three currents add up to zero, so the mean of their sum over four
 * turns of the field is the sum of the zero errors. Gain errors give a sine of the field's angle, which that mean cancels,
 * however unevenly the field turns. Not evaluated if four turns take longer than 8 s, within 8 Hz of a multiple of 1 kHz, or if
 * a phase is calculated from the other two.
 */

struct zero_watch {
    int64_t sum_q30;    /* of the three currents, each times w_q15, over the samples so far */
    int32_t travel_q15; /* of the field: a sum of w_q15 */
    int32_t samples;    /* with all three seen */
};

/* Starts. Slow loop, when operation begins. */
void zero_watch_begin(struct zero_watch *z);

/* Slow loop, every millisecond, with the newest sample. Reports FAULT_CURRENT_OFFSET with the sum in mA. */
void zero_watch_step(struct zero_watch *z, struct axis *a);

#endif
