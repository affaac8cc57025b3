/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "irqlog.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cycles.h"
#include "recording.h"

#define DEEPEST      64
#define LINES        128
#define NS_PER_CYCLE (SIM_PS_PER_FABRIC_CLOCK / SIM_PS_PER_NS)

struct frame {
    unsigned exception;
    bool chained, has_line;
    sim_ps t;
    int64_t start_ns, start_pwm_ns;
    struct cycles_count begin, preempted;
    uint64_t instructions, preempted_instructions;
    uint64_t latency;
};

struct line {
    bool rose;
    sim_ps at, period_start;
    uint64_t count;
};

static struct recording log_file;
static sim_ps (*time_now)(void);
static struct frame frames[DEEPEST];
static unsigned depth;
static struct line lines[LINES];

void irqlog_open(const char *path, sim_ps (*time)(void))
{
    static const char *const names[] = {"t_s",        "exception",    "start_ns",       "start_pwm_ns",
                                        "cycles",     "instructions", "latency_cycles", "preempted_cycles",
                                        "cycles_low", "chained"};
    recording_open(&log_file, "irqlog", path, names, sizeof names / sizeof names[0]);
    time_now = time;
}

void irqlog_line_rose(unsigned exception, sim_ps at, sim_ps period_start)
{
    if (recording_is_open(&log_file) && exception < LINES) {
        lines[exception] = (struct line){true, at, period_start, cycles_total().high};
    }
}

static void note_line(struct frame *f)
{
    struct line *line = f->exception < LINES ? &lines[f->exception] : NULL;
    if (!line || !line->rose) {
        f->t = time_now();
        return;
    }
    line->rose = false;
    f->has_line = true;
    f->t = line->at;
    f->start_ns = (int64_t)(cycles_total().high - line->count) * NS_PER_CYCLE;
    f->start_pwm_ns = f->start_ns + (line->at - line->period_start) / SIM_PS_PER_NS;
}

void irqlog_entered(unsigned exception, unsigned entry_cycles)
{
    if (!recording_is_open(&log_file)) {
        return;
    }
    if (depth == DEEPEST) {
        fputs("mssfoc twin: irqlog: exceptions are nested deeper than there are priorities\n", stderr);
        exit(1);
    }
    struct frame *f = &frames[depth++];
    *f = (struct frame){.exception = exception, .begin = cycles_total(), .instructions = cycles_instructions()};
    f->begin.low -= entry_cycles;
    f->begin.high -= entry_cycles;
    f->chained = entry_cycles < 12;
    note_line(f);
}

void irqlog_returned(bool chained)
{
    if (!recording_is_open(&log_file) || depth == 0) {
        return;
    }
    struct frame *f = &frames[--depth];
    struct cycles_count end = cycles_total();
    uint64_t low = end.low - f->begin.low, high = end.high - f->begin.high;
    /* The instruction now announced is the first one after the return. */
    uint64_t executed = cycles_instructions() - f->instructions;
    double *row = recording_row(&log_file);
    *row++ = sim_recorded_s(sim_to_s(f->t));
    *row++ = f->exception;
    *row++ = (double)f->start_ns;
    *row++ = (double)f->start_pwm_ns;
    *row++ = (double)(high - f->preempted.high);
    *row++ = (double)(executed - f->preempted_instructions);
    *row++ = (double)f->latency;
    *row++ = (double)f->preempted.high;
    *row++ = (double)(low - f->preempted.low);
    *row++ = f->chained + 2 * chained;
    if (depth > 0) {
        struct frame *below = &frames[depth - 1];
        below->preempted.low += low;
        below->preempted.high += high;
        below->preempted_instructions += executed;
    }
}

void irqlog_pwm_written(unsigned exception, uint64_t done)
{
    if (recording_is_open(&log_file) && depth > 0) {
        struct frame *f = &frames[depth - 1];
        bool of_another_line = f->has_line && f->exception != exception;
        f->latency = of_another_line ? f->latency : done - f->begin.high - f->preempted.high;
    }
}

void irqlog_reset(void)
{
    depth = 0;
    memset(lines, 0, sizeof lines);
}

void irqlog_flush(void)
{
    recording_flush(&log_file);
}
