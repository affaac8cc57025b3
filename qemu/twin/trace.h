/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The recorder: one CSV row per ADC trigger. Fixed formatting, so that equal runs give equal files. */
#ifndef TWIN_TRACE_H
#define TWIN_TRACE_H

#include <stddef.h>

#include "config.h"
#include "plant.h"

/* Opens the file and writes the header; ends the process with one line if that fails. */
void trace_open(const char *path, const struct probe *probes, size_t probe_count);
/* Keeps the row until the probes that belong to it are known: just before the next one, or at the end. */
void trace_row(const struct plant_row *row);
/* Writes the row that is waiting, with what the probes read now. */
void trace_complete_row(const double *probe_values);
/* Everything so far reaches the file. Safe in a signal handler. */
void trace_flush(void);

#endif
