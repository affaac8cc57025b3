/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "trace.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "recording.h"
#include "trace_csv.h"

static const struct {
    const char *name;
    int decimals; /* in the CSV */
} fixed[] = {
    {"t_s", 9},
    {"v_a_V", 4},
    {"v_b_V", 4},
    {"v_c_V", 4},
    {"i_a_A", 5},
    {"i_b_A", 5},
    {"i_c_A", 5},
    {"theta_mech_rad", 6},
    {"speed_rad_s", 4},
    {"torque_Nm", 7},
    {"load_Nm", 7},
    {"vbus_V", 4},
    {"duty_a", 6},
    {"duty_b", 6},
    {"duty_c", 6},
    {"gates", 0},
    {"gate_live", 0},
    {"winding_C", 3},
    {"i_a_rms_A", 5},
    {"i_b_rms_A", 5},
    {"i_c_rms_A", 5},
    {"i_a_peak_A", 5},
    {"i_b_peak_A", 5},
    {"i_c_peak_A", 5},
    {"torque_mean_Nm", 7},
    {"load_speed_rad_s", 4},
    {"magnet_C", 3},
    {"i_a_mean_A", 5},
    {"i_b_mean_A", 5},
    {"i_c_mean_A", 5},
    {"hall", 0},
};
#define FIXED (sizeof fixed / sizeof fixed[0])

struct trace {
    struct recording recording;
    struct trace_csv *csv;
    double *waiting; /* a row, its probes not yet known */
    bool row_waits, wanted;
    size_t column_count;
};

static void *room(size_t count, size_t size)
{
    void *array = calloc(count, size);
    if (!array) {
        fputs("mssfoc twin: out of memory\n", stderr);
        exit(1);
    }
    return array;
}

struct trace *trace_open(const char *path, const char *csv_path, const struct probe *probes, size_t probe_count)
{
    struct trace *t = room(1, sizeof *t);
    t->column_count = FIXED + probe_count;
    const char **names = room(t->column_count, sizeof *names);
    int *decimals = room(t->column_count, sizeof *decimals); /* stays, with the CSV */
    t->waiting = room(t->column_count, sizeof *t->waiting);
    for (size_t n = 0; n < t->column_count; n++) {
        names[n] = n < FIXED ? fixed[n].name : probes[n - FIXED].name;
        decimals[n] = n < FIXED ? fixed[n].decimals : probes[n - FIXED].scale == 1 ? 0 : 6;
    }
    if (path) {
        recording_open(&t->recording, "trace", path, names, t->column_count);
    }
    t->csv = csv_path ? trace_csv_open(csv_path, names, decimals, t->column_count) : NULL;
    free(names);
    t->wanted = path || csv_path;
    return t;
}

static double *put_phases(double *next, const double phases[3])
{
    memcpy(next, phases, 3 * sizeof *phases);
    return next + 3;
}

void trace_row(struct trace *t, const struct plant_row *row)
{
    if (!t->wanted) {
        return;
    }
    double *next = t->waiting;
    *next++ = sim_recorded_s(row->t_s);
    next = put_phases(next, row->v_mean_v);
    next = put_phases(next, row->i_a);
    *next++ = row->theta_mech_rad;
    *next++ = row->speed_rad_s;
    *next++ = row->torque_nm;
    *next++ = row->load_nm;
    *next++ = row->bus_v;
    next = put_phases(next, row->duty);
    *next++ = row->gates;
    *next++ = row->live;
    *next++ = row->winding_c;
    next = put_phases(next, row->i_rms_a);
    next = put_phases(next, row->i_peak_a);
    *next++ = row->torque_mean_nm;
    *next++ = row->load_speed_rad_s;
    *next++ = row->magnet_c;
    next = put_phases(next, row->i_mean_a);
    *next++ = row->hall;
    t->row_waits = true;
}

void trace_complete_row(struct trace *t, const double *probe_values)
{
    if (!t->row_waits) {
        return;
    }
    t->row_waits = false;
    memcpy(t->waiting + FIXED, probe_values, (t->column_count - FIXED) * sizeof *probe_values);
    if (recording_is_open(&t->recording)) {
        memcpy(recording_row(&t->recording), t->waiting, t->column_count * sizeof *t->waiting);
    }
    if (t->csv) {
        trace_csv_row(t->csv, t->waiting);
    }
}

void trace_flush(struct trace *t)
{
    recording_flush(&t->recording);
    if (t->csv) {
        trace_csv_flush(t->csv);
    }
}
