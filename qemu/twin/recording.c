/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE
#include "recording.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define BUFFER_BYTES (1u << 18)

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "rows are written as they stand in memory");

int recording_create(const char *what, const char *path)
{
    int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0) {
        fprintf(stderr, "mssfoc twin: %s %s: %s\n", what, path, strerror(errno));
        exit(1);
    }
    return file;
}

/* A recording with a gap is worse than none. exit() is left out: this may be called on the way out, or by a signal. */
void recording_write(int file, const char *bytes, size_t length)
{
    for (size_t done = 0; done < length;) {
        ssize_t n = write(file, bytes + done, length - done);
        if (n < 0 && errno != EINTR) {
            dprintf(STDERR_FILENO, "mssfoc twin: cannot write a recording: %s\n", strerror(errno));
            _exit(1);
        }
        done += n > 0 ? (size_t)n : 0;
    }
}

void recording_open(struct recording *r, const char *what, const char *path, const char *const *names, size_t count)
{
    *r = (struct recording){recording_create(what, path), count, malloc(BUFFER_BYTES), 0};
    if (!r->buffer) {
        fputs("mssfoc twin: out of memory\n", stderr);
        exit(1);
    }
    for (size_t n = 0; n < count; n++) {
        recording_write(r->file, names[n], strlen(names[n]));
        recording_write(r->file, n + 1 < count ? "," : "\n", 1);
    }
}

bool recording_is_open(const struct recording *r)
{
    return r->buffer != NULL;
}

double *recording_row(struct recording *r)
{
    size_t bytes = r->columns * sizeof(double);
    if (r->used + bytes > BUFFER_BYTES) {
        recording_flush(r);
    }
    r->used += bytes;
    return (double *)(void *)(r->buffer + r->used - bytes);
}

void recording_flush(struct recording *r)
{
    if (r->buffer) {
        recording_write(r->file, r->buffer, r->used);
        r->used = 0;
    }
}
