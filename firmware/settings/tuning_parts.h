/* SPDX-License-Identifier: MIT */
/* The parts of tuning_compute(): each fills its own fields and reports what it cannot express. Thread. */
#ifndef FIRMWARE_SETTINGS_TUNING_PARTS_H
#define FIRMWARE_SETTINGS_TUNING_PARTS_H

#include "firmware/settings/tuning.h"

/* Refused because `number`, proportional to `value`, is not `fits`: returns the value with which it would be, or just less. */
static inline struct outcome tuning_instead(enum error error, int64_t value, int64_t fits, int64_t number)
{
    const int64_t instead = scale(value, fits, number < 1 ? 1 : number);
    return (struct outcome){error, scale_clamp(fits > 1 ? instead - 1 : instead, 0, INT32_MAX)};
}

void tuning_rates(const struct params *p, struct tuning *t); /* first */
struct outcome tuning_current(const struct params *p, struct tuning *t);
struct outcome tuning_speed(const struct params *p, struct tuning *t);  /* after the limits of the currents */
struct outcome tuning_torque(const struct params *p, struct tuning *t); /* after both */
void tuning_position(const struct params *p, struct tuning *t);         /* after the limits of the currents */
void tuning_start(const struct params *p, struct tuning *t);
enum error tuning_observer(const struct params *p, struct tuning *t); /* after all of them */

#endif
