/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Numbers are written as scaled integers: several times faster than printf, and there is no "-0.0000". */
#define _GNU_SOURCE
#include "trace.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define BUFFER_BYTES (1u << 18)
#define NUMBER_BYTES 32

static int file = -1;
static char buffer[BUFFER_BYTES];
static size_t used;
static struct plant_row waiting;
static bool row_waits;
static const struct probe *columns;
static size_t column_count;

static const char fixed_columns[] =
    "t_s,v_a_V,v_b_V,v_c_V,i_a_A,i_b_A,i_c_A,theta_mech_rad,speed_rad_s,torque_Nm,load_Nm,vbus_V,"
    "duty_a,duty_b,duty_c,gates,gate_live,winding_C";

void trace_flush(void)
{
    size_t done = 0;
    while (file >= 0 && done < used) {
        ssize_t n = write(file, buffer + done, used - done);
        if (n <= 0) {
            break;
        }
        done += (size_t)n;
    }
    used = 0;
}

static void put_text(const char *text)
{
    size_t length = strlen(text);
    if (used + length > BUFFER_BYTES) {
        trace_flush();
    }
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

void trace_open(const char *path, const struct probe *probes, size_t probe_count)
{
    file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0) {
        fprintf(stderr, "mssfoc twin: trace %s: %s\n", path, strerror(errno));
        exit(1);
    }
    columns = probes;
    column_count = probe_count;
    put_text(fixed_columns);
    for (size_t n = 0; n < probe_count; n++) {
        put_text(",");
        put_text(probes[n].name);
    }
    put_text("\n");
    trace_flush();
}

void trace_row(const struct plant_row *row)
{
    waiting = *row;
    row_waits = file >= 0;
}

void trace_complete_row(const double *probe_values)
{
    const struct plant_row *r = &waiting;
    if (!row_waits) {
        return;
    }
    row_waits = false;
    if (used + (20 + column_count) * NUMBER_BYTES > BUFFER_BYTES) {
        trace_flush();
    }
    put_number(r->t_s, 9, ',');
    for (int k = 0; k < 3; k++) {
        put_number(r->v_mean_v[k], 4, ',');
    }
    for (int k = 0; k < 3; k++) {
        put_number(r->i_a[k], 5, ',');
    }
    put_number(r->theta_mech_rad, 6, ',');
    put_number(r->speed_rad_s, 4, ',');
    put_number(r->torque_nm, 7, ',');
    put_number(r->load_nm, 7, ',');
    put_number(r->bus_v, 4, ',');
    for (int k = 0; k < 3; k++) {
        put_number(r->duty[k], 6, ',');
    }
    put_number(r->gates, 0, ',');
    put_number(r->live, 0, ',');
    put_number(r->winding_c, 3, column_count ? ',' : '\n');
    for (size_t n = 0; n < column_count; n++) {
        put_number(probe_values[n], columns[n].scale == 1 ? 0 : 6, n + 1 < column_count ? ',' : '\n');
    }
}
