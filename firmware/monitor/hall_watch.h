/* SPDX-License-Identifier: MIT */
/*
 * Checks the Hall switches against themselves: a state that the table does not have means a broken wire or a switch without
 * supply; a skipped sector means a disturbance, or a rotor too fast for the sampling. A wire that breaks at standstill shows
 * when the rotor turns.
 *
 * A breaking wire adds an edge or hides one, up to half an electrical turn before it shows. So the rotor is tracked meanwhile,
 * for carrying on without the switches (drive/failover.h): once the angle is more than 15 degrees from what the earlier speed
 * predicts, that speed is extrapolated for an electrical turn. After that the switches are believed.
 *
 * Wires that are exchanged, or a table that is wrong, skip nothing: the frame turns by itself, and the EMF does not turn with
 * it. So while there is more EMF to expect than resistance and dead time may hide, half of it must be where the switches say;
 * otherwise the drive could push at its limit for ever, and a shaft turn the other way.
 */
#ifndef FIRMWARE_MONITOR_HALL_WATCH_H
#define FIRMWARE_MONITOR_HALL_WATCH_H

#include <stdint.h>

#include "firmware/source/rotor_seed.h"

struct axis;

struct hall_watch {
    uint32_t invalid, skipped;   /* the interrupt's counts at the last step */
    struct rotor_seed sound;     /* the rotor at that step, whatever the switches say */
    uint32_t doubt_ms;           /* how long they have said something else */
    uint32_t doubt_q16;          /* and how far it has turned since, electrical turns */
    int32_t torque_q29;          /* the speed loop's torque memory before that */
    int32_t emf_q4, expected_q4; /* along the frame, filtered; 4 more bits */
    uint32_t wrong_ms;           /* that the former is missing */
};

/* Starts afresh. Slow loop. */
void hall_watch_begin(struct axis *a);

/* One millisecond of operation with Hall switches; may raise a fault. Slow loop. */
void hall_watch_step(struct axis *a);

/* The cause of an over-current now: the switches, if the frame has just jumped. Current loop's interrupt, cold. */
enum fault hall_watch_blame(const struct axis *a, enum fault seen);

/* The speed loop's torque memory from before the switches were in doubt. Slow loop. */
int32_t hall_watch_torque_q29(const struct axis *a);

#endif
