/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The recorder: one row per ADC trigger, as a recording (recording.h), and for a reader of text as CSV. */
#ifndef TWIN_TRACE_H
#define TWIN_TRACE_H

#include <stddef.h>

#include "config.h"
#include "plant.h"

struct trace;

/* Either path may be NULL. A file that cannot be written ends the process with one line. */
struct trace *trace_open(const char *path, const char *csv_path, const struct probe *probes, size_t probe_count);
/* Keeps the row until the probes that belong to it are known: just before the next one, or at the end. */
void trace_row(struct trace *t, const struct plant_row *row);
/* Writes the row that is waiting, with what the probes read now. */
void trace_complete_row(struct trace *t, const double *probe_values);
/* Everything so far reaches the file. Safe in a signal handler. */
void trace_flush(struct trace *t);

#endif
