/* SPDX-License-Identifier: MIT */
/* Between the files keeping*.c. */
#ifndef FIRMWARE_AXIS_KEEPING_PARTS_H
#define FIRMWARE_AXIS_KEEPING_PARTS_H

#include "firmware/settings/error.h"
#include "firmware/settings/tuning.h"

/* Whether a set holds together, as `on` asks; `t` is then its tuning. Thread. */
struct outcome keeping_check(const struct params *p, struct tuning *t);

#endif
