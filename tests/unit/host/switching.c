/* SPDX-License-Identifier: MIT */
/* Switching on with nobody at the bus: to the end at once. */
#include "firmware/drive/drive.h"

struct outcome switch_on_at_once(struct axis *a);

struct outcome switch_on_at_once(struct axis *a)
{
    const struct outcome outcome = drive_switch_on(a);
    if (outcome.error != ERROR_NONE) {
        return outcome;
    }
    while (drive_prepare(a)) {
    }
    return a->switching.outcome;
}
