/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The trace as text. Fixed formatting, so that equal runs give equal files. */
#ifndef TWIN_TRACE_CSV_H
#define TWIN_TRACE_CSV_H

#include <stddef.h>

struct trace_csv;

/* `decimals` must stay. A file that cannot be written ends the process with one line. */
struct trace_csv *trace_csv_open(const char *path, const char *const *names, const int *decimals, size_t count);
void trace_csv_row(struct trace_csv *t, const double *values);
void trace_csv_flush(struct trace_csv *t);

#endif
