/* SPDX-License-Identifier: MIT */
/*
 * Switching on needs tables that take longer to build than a request may wait (control/torque_build.h). They are built in
 * parts, and the thread serves its lines in between: drive_switch_on() begins, drive_prepare() goes on. Until the last part the
 * axis is neither on nor counts as off: parameters stay as they are. Thread.
 *
 * The axis starts a whole number of SWITCHING_PACE_MS after drive_switch_on(): what the tables take depends on motor, compiler
 * and whatever else the thread serves, and the same command starts the same motor in the same millisecond.
 */
#ifndef FIRMWARE_DRIVE_SWITCHING_H
#define FIRMWARE_DRIVE_SWITCHING_H

#include <stdbool.h>

#include "firmware/control/torque_build.h"
#include "firmware/settings/error.h"
#include "firmware/settings/tuning.h"

#define SWITCHING_PACE_MS 32u

struct switching {
    bool under_way;
    bool built;             /* the tables are */
    bool retries;           /* who commands has asked for it: it is tried again after a fault */
    uint32_t begun_ms;      /* axis.time_ms at drive_switch_on() */
    uint32_t waits_ms;      /* from then to the request */
    struct outcome outcome; /* of the last one that ended */
    struct tuning tuning;   /* to take effect */
    struct torque_builder builder;
};

/* Ends the one under way, if any, with `error`. */
static inline void switching_end(struct switching *s, enum error error)
{
    if (s->under_way) {
        s->under_way = false;
        s->outcome = outcome_of(error);
    }
}

#endif
