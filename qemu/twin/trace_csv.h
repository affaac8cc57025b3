/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The trace as text. Fixed formatting, so that equal runs give equal files. */
#ifndef TWIN_TRACE_CSV_H
#define TWIN_TRACE_CSV_H

#include <stddef.h>

void trace_csv_open(const char *path, const char *const *names, const int *decimals, size_t count);
/* Does nothing without a file. */
void trace_csv_row(const double *values);
void trace_csv_flush(void);

#endif
