/* SPDX-License-Identifier: MIT */
/* The units of parameters, for people. Any context: constant strings. */
#ifndef FIRMWARE_OPERATE_UNITS_H
#define FIRMWARE_OPERATE_UNITS_H

#include "firmware/settings/params.h"

/* "mA", "rpm/s"; "" if there is none. Derived from the end of the name. */
const char *unit_of(const struct param_info *info);

#endif
