/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Memory of the guest at the end of a run, for what no single variable shows: the painted stack. */
#ifndef TWIN_DUMP_H
#define TWIN_DUMP_H

#include <stddef.h>

#include "config.h"

/* Creates the files, so that a path that cannot be written ends the process before the run. */
void dump_open(const struct dump *dumps, size_t count);
/* Reads and writes them all. */
void dump_write(const struct dump *dumps, size_t count);

#endif
