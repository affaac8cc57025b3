/* SPDX-License-Identifier: MIT */
/*
 * Switching on needs tables that take longer to build than a request may wait (control/torque_build.h). They are built in
 * parts, and the thread serves its interfaces in between: drive_switch_on() begins, drive_prepare() continues. Until the last
 * part the axis is neither on nor off: parameters cannot change. Thread.
 *
 * The axis starts a multiple of SWITCHING_PACE_MS after drive_switch_on(), so that the start does not depend on how long the
 * tables take, which varies with motor, compiler and load of the thread.
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
    bool retries;           /* commanded by the owner: retried after a fault */
    uint32_t begun_ms;      /* axis.time_ms at drive_switch_on() */
    uint32_t waits_ms;      /* delay from then to the request */
    struct outcome outcome; /* of the last one that ended */
    struct tuning tuning;   /* to take effect */
    struct torque_builder builder;
};

/* Ends a switch-on in progress, if any, with `error`. */
static inline void switching_end(struct switching *s, enum error error)
{
    if (s->under_way) {
        s->under_way = false;
        s->outcome = outcome_of(error);
    }
}

#endif
