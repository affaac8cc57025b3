/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Numbers are written as scaled integers: several times faster than printf, and there is no "-0.0000". */
#include "trace_csv.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "recording.h"

#define BUFFER_BYTES (1u << 18)
#define NUMBER_BYTES 32

struct trace_csv {
    int file;
    size_t used; /* of the buffer */
    const int *places;
    size_t columns;
    char buffer[BUFFER_BYTES];
};

static void put(struct trace_csv *t, const char *text, size_t length)
{
    memcpy(t->buffer + t->used, text, length);
    t->used += length;
}

static void put_number(struct trace_csv *t, double value, int decimals, char after)
{
    static const double scale[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
    char digits[NUMBER_BYTES];
    int n = NUMBER_BYTES;
    double scaled = value * scale[decimals];
    if (!(fabs(scaled) < 9e18)) {
        put(t, isnan(value) ? "nan" : "inf", 3);
        put(t, &after, 1);
        return;
    }
    int64_t whole = llround(scaled);
    bool negative = whole < 0;
    uint64_t rest = negative ? -(uint64_t)whole : (uint64_t)whole;
    digits[--n] = after;
    for (int place = 0; rest || place <= decimals; place++) {
        if (place == decimals && decimals) {
            digits[--n] = '.';
        }
        digits[--n] = (char)('0' + rest % 10);
        rest /= 10;
    }
    if (negative) {
        digits[--n] = '-';
    }
    put(t, digits + n, (size_t)(NUMBER_BYTES - n));
}

struct trace_csv *trace_csv_open(const char *path, const char *const *names, const int *decimals, size_t count)
{
    struct trace_csv *t = malloc(sizeof *t);
    if (!t) {
        fputs("mssfoc twin: out of memory\n", stderr);
        exit(1);
    }
    t->file = recording_create("trace", path);
    t->used = 0;
    t->places = decimals;
    t->columns = count;
    for (size_t n = 0; n < count; n++) {
        recording_write(t->file, names[n], strlen(names[n]));
        recording_write(t->file, n + 1 < count ? "," : "\n", 1);
    }
    return t;
}

void trace_csv_row(struct trace_csv *t, const double *values)
{
    if (t->used + t->columns * NUMBER_BYTES > BUFFER_BYTES) {
        trace_csv_flush(t);
    }
    for (size_t n = 0; n < t->columns; n++) {
        put_number(t, values[n], t->places[n], n + 1 < t->columns ? ',' : '\n');
    }
}

void trace_csv_flush(struct trace_csv *t)
{
    recording_write(t->file, t->buffer, t->used);
    t->used = 0;
}
