/* SPDX-License-Identifier: MIT */
/*
 * Finds a current sensor whose zero has moved since `on`: the three currents add up to nothing, so the average of their
 * sum over four turns of the field is the sensors' zeros. Wrong gains add up to a sine of the field's angle, which the average
 * over that angle takes away, however unevenly the field turns. Nothing is said of a field that takes longer for four turns
 * than 8 s or turns within 8 Hz of a multiple of 1 kHz, nor where a phase is only calculated from the other two.
 */
#ifndef FIRMWARE_MONITOR_ZERO_WATCH_H
#define FIRMWARE_MONITOR_ZERO_WATCH_H

#include <stdint.h>

struct axis;

struct zero_watch {
    int64_t sum_q30;    /* of the three currents, each times w_q15, over the samples so far */
    int32_t travel_q15; /* of the field: a sum of w_q15 */
    int32_t samples;    /* with all three seen */
};

/* Starts. Slow loop, when operation begins. */
void zero_watch_begin(struct zero_watch *z);

/* Slow loop, every millisecond: a look at the newest sample. Reports FAULT_CURRENT_OFFSET with the sum in mA. */
void zero_watch_step(struct zero_watch *z, struct axis *a);

#endif
