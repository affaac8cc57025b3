/* SPDX-License-Identifier: MIT */
/*
 * Monitors while the motor runs, once a millisecond, last in the slow loop. Each part reports a fault (fault/fault.h);
 * drive/reaction.h decides what follows. The order is that in which one fault could pass for another: encoder, phases, then
 * their effects on the speed and current loops.
 */
#ifndef FIRMWARE_MONITOR_SUPERVISION_H
#define FIRMWARE_MONITOR_SUPERVISION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/monitor/encoder_watch.h"
#include "firmware/monitor/phase_watch.h"

/* ==== the speed ==== */

/* Compares the speed with its reference: lost, stalled or oscillating. */

struct speed_watch {
    int32_t deviation_q4; /* rpm: the limit */
    uint32_t far_ms;      /* on one side of the reference: an oscillation about it is not a lost speed */
    bool below;           /* the reference, a millisecond ago: the error is negative */
    bool crossed;         /* the reference, since the last step */
    int32_t speed_q4;     /* at the last step */
    int32_t rate_q4;      /* at which the speed leaves the reference, per step, filtered */
    uint32_t losing_ms;   /* how long it has been about to exceed the limit, at full current */
    bool coming_to_rest;  /* it was decelerating to standstill within milliseconds when it last moved */
    uint32_t stalled_ms;
    uint32_t oscillations; /* count of the speed loop when last read */
};

/* A limit cycle: half waves of the speed error, nearly equal in length, with much current. */
struct cycle_watch {
    bool error_below;
    uint32_t answered;         /* how often the speed loop has reduced its gains by itself */
    uint32_t half_ms;          /* of the present half wave */
    uint32_t last_half_ms;     /* of the one before */
    uint32_t halves;           /* similar ones in a row */
    int32_t low_q15, high_q15; /* extremes of the current in this half wave and the last */
    int32_t last_low_q15, last_high_q15;
};

/* Slow loop, every second millisecond. */
void speed_watch_step(struct axis *a);

struct axis;

struct supervision {
    struct encoder_watch encoder;
    struct phase_watch phases;
    struct zero_watch zeros;
    struct speed_watch speed;
    struct cycle_watch cycle;
    uint32_t limited_ms; /* how long the voltage has been limited and the current off its reference */
};

/* Starts, from the parameters. Slow loop, when operation begins. */
void supervision_begin(struct axis *a);

/* The same without the encoder's part, after a failover. Slow loop. */
void supervision_begin_again(struct axis *a);

/* The owner has sent nothing for longer than command_timeout_ms. Any context. */
bool supervision_is_silent(const struct axis *a);

/* One step. Slow loop, last. */
void supervision_step(struct axis *a);

#endif
