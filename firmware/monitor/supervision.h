/* SPDX-License-Identifier: MIT */
/*
 * Monitors while the motor runs, once a millisecond, last in the slow loop. Each part reports a fault (fault/fault.h);
 * drive/reaction.h decides what follows. The order is that in which one fault could pass for another: encoder, phases, then
 * their effects on the speed and current loops.
 */
#ifndef FIRMWARE_MONITOR_SUPERVISION_H
#define FIRMWARE_MONITOR_SUPERVISION_H

#include "firmware/monitor/encoder_watch.h"
#include "firmware/monitor/phase_watch.h"
#include "firmware/monitor/speed_watch.h"

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

/* The same without the encoder's part, which has given the rotor up. Slow loop. */
void supervision_begin_again(struct axis *a);

/* Who commands has said nothing for longer than command_timeout_ms. Any context. */
bool supervision_is_silent(const struct axis *a);

/* One step. Slow loop, last. */
void supervision_step(struct axis *a);

#endif
