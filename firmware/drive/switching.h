/* SPDX-License-Identifier: MIT */
/*
 * Switching on needs tables that take longer to build than a request may wait (control/torque_build.h). They are built in
 * parts, and the thread serves its lines in between: drive_switch_on() begins, drive_prepare() goes on. Until the last part the
 * axis is neither on nor counts as off: parameters stay as they are. Thread.
 */
#ifndef FIRMWARE_DRIVE_SWITCHING_H
#define FIRMWARE_DRIVE_SWITCHING_H

#include <stdbool.h>

#include "firmware/control/torque_build.h"
#include "firmware/settings/error.h"
#include "firmware/settings/tuning.h"

struct switching {
    bool under_way;
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
