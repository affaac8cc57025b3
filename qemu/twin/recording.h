/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A file of numbers: one line of text names the columns, separated by commas; then rows of doubles, little-endian. What
 * the launcher reads in one go, and costs the run next to nothing (launcher/recording.py). */
#ifndef TWIN_RECORDING_H
#define TWIN_RECORDING_H

#include <stdbool.h>
#include <stddef.h>

struct recording {
    int file; /* 0: not open */
    size_t columns;
    char *buffer;
    size_t used;
};

/* A file that cannot be written ends the process with one line that begins with `what`. */
void recording_open(struct recording *r, const char *what, const char *path, const char *const *names, size_t count);
bool recording_is_open(const struct recording *r);
/* Room for the next row; all of it is to be written. */
double *recording_row(struct recording *r);
/* Everything so far reaches the file. Safe in a signal handler. */
void recording_flush(struct recording *r);

/* For files of text that are buffered in the same way. */
int recording_create(const char *what, const char *path);
void recording_write(int file, const char *bytes, size_t length);

#endif
