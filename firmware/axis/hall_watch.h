/* SPDX-License-Identifier: MIT */
/*
 * Whether the Hall switches tell the truth, as far as they show it themselves: a state that the table does not have is a wire
 * that is broken, or a switch without its supply; a sector that is skipped is a disturbance, or a rotor faster than any sample
 * follows. A wire that breaks while the rotor stands shows when it turns.
 */
#ifndef FIRMWARE_AXIS_HALL_WATCH_H
#define FIRMWARE_AXIS_HALL_WATCH_H

#include <stdint.h>

struct axis;

struct hall_watch {
    uint32_t invalid, skipped; /* of the interrupt's counts, as of the last step */
};

/* What was before does not count. Slow loop. */
void hall_watch_begin(struct axis *a);

/* A millisecond of operation by Hall switches; may raise a fault. Slow loop. */
void hall_watch_step(struct axis *a);

#endif
