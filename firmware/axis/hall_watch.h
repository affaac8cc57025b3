/* SPDX-License-Identifier: MIT */
/*
 * Whether the Hall switches tell the truth, as far as they show it themselves: a state that the table does not have is a wire
 * that is broken, or a switch without its supply; a sector that is skipped is a disturbance, or a rotor faster than any sample
 * follows. A wire that breaks while the rotor stands shows when it turns.
 *
 * A wire that breaks makes an edge where there is none, or hides one, up to half an electrical turn before it shows. So the
 * rotor is followed on the way, for who carries on without the switches (axis/carry.h): once the angle is by more than 15
 * degrees not where the speed before would have it, that speed goes on for an electrical turn. Then the switches are believed.
 */
#ifndef FIRMWARE_AXIS_HALL_WATCH_H
#define FIRMWARE_AXIS_HALL_WATCH_H

#include <stdint.h>

#include "firmware/axis/carry.h"

struct axis;

struct hall_watch {
    uint32_t invalid, skipped; /* of the interrupt's counts, as of the last step */
    struct rotor_seed sound;   /* the rotor as of then, whatever the switches say */
    uint32_t doubt_ms;         /* since when they say something else */
    uint32_t doubt_q16;        /* and how far it has turned since, electrical turns */
    int32_t torque_q29;        /* what the speed loop remembered of the torque before */
};

/* What was before does not count. Slow loop. */
void hall_watch_begin(struct axis *a);

/* A millisecond of operation by Hall switches; may raise a fault. Slow loop. */
void hall_watch_step(struct axis *a);

/* What an over-current is that comes now: the switches', if the frame has just jumped. Current loop's interrupt, cold. */
enum fault hall_watch_blame(const struct axis *a, enum fault seen);

/* What the speed loop remembered before the switches were in doubt. Slow loop. */
int32_t hall_watch_torque_q29(const struct axis *a);

#endif
