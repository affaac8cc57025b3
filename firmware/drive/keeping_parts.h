/* SPDX-License-Identifier: MIT */
/* Shared by keeping*.c. */
#ifndef FIRMWARE_DRIVE_KEEPING_PARTS_H
#define FIRMWARE_DRIVE_KEEPING_PARTS_H

#include "firmware/settings/error.h"
#include "firmware/settings/tuning.h"

/* Checks a set for consistency as `on` does; `t` is then its tuning. Thread. */
struct outcome keeping_check(const struct params *p, struct tuning *t);

#endif
