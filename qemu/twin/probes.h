/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Variables of the firmware, watched by address like a debugger's live watch. */
#ifndef TWIN_PROBES_H
#define TWIN_PROBES_H

#include <stddef.h>

#include "config.h"

/* Reads them all from the guest's memory, scaled. */
void probes_read(const struct probe *probes, size_t count, double *values);

#endif
