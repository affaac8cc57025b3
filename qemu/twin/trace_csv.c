/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Numbers are written as scaled integers: several times faster than printf, and there is no "-0.0000". */
#include "trace_csv.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "recording.h"

#define BUFFER_BYTES (1u << 18)
#define NUMBER_BYTES 32

static int file; /* 0: none */
static char buffer[BUFFER_BYTES];
static size_t used;
static const int *places;
static size_t columns;

static void put_text(const char *text)
{
    size_t length = strlen(text);
    memcpy(buffer + used, text, length);
    used += length;
}

static void put_number(double value, int decimals, char after)
{
    static const double scale[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
    char digits[NUMBER_BYTES];
    int n = NUMBER_BYTES;
    double scaled = value * scale[decimals];
    if (!(fabs(scaled) < 9e18)) {
        put_text(isnan(value) ? "nan" : "inf");
        buffer[used++] = after;
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
    memcpy(buffer + used, digits + n, (size_t)(NUMBER_BYTES - n));
    used += (size_t)(NUMBER_BYTES - n);
}

void trace_csv_open(const char *path, const char *const *names, const int *decimals, size_t count)
{
    file = recording_create("trace", path);
    places = decimals;
    columns = count;
    for (size_t n = 0; n < count; n++) {
        recording_write(file, names[n], strlen(names[n]));
        recording_write(file, n + 1 < count ? "," : "\n", 1);
    }
}

void trace_csv_row(const double *values)
{
    if (!file) {
        return;
    }
    if (used + columns * NUMBER_BYTES > BUFFER_BYTES) {
        trace_csv_flush();
    }
    for (size_t n = 0; n < columns; n++) {
        put_number(values[n], places[n], n + 1 < columns ? ',' : '\n');
    }
}

void trace_csv_flush(void)
{
    if (file) {
        recording_write(file, buffer, used);
        used = 0;
    }
}
