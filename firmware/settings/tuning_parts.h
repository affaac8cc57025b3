/* SPDX-License-Identifier: MIT */
/* The parts of tuning_compute(): each fills its own fields and reports what it cannot express. Thread. */
#ifndef FIRMWARE_SETTINGS_TUNING_PARTS_H
#define FIRMWARE_SETTINGS_TUNING_PARTS_H

#include "firmware/settings/tuning.h"

void tuning_rates(const struct params *p, struct tuning *t); /* first */
enum error tuning_current(const struct params *p, struct tuning *t);
enum error tuning_speed(const struct params *p, struct tuning *t); /* after the limits of the currents */
void tuning_torque(const struct params *p, struct tuning *t);      /* after both */
void tuning_position(const struct params *p, struct tuning *t);    /* after the limits of the currents */
void tuning_start(const struct params *p, struct tuning *t);
enum error tuning_observer(const struct params *p, struct tuning *t); /* after all of them */

#endif
