/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "irqpath.h"

#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cycles.h"

#define LONGEST_WAY 65536
#define DURATIONS   64 /* more than that many different ones say no more */

struct visit {
    uint32_t address;
    uint64_t at;
};

static FILE *file;
static unsigned watched;
static struct visit way[LONGEST_WAY];
static size_t length;
static unsigned inside; /* levels of exceptions since the watched one was entered, itself included */
static bool disturbed;
static uint64_t begin;
static double begin_s;
static uint64_t known[DURATIONS];
static size_t known_count;

void irqpath_open(const char *path, unsigned exception)
{
    file = fopen(path, "w");
    if (!file) {
        fprintf(stderr, "mssfoc twin: irqpath %s: %s\n", path, strerror(errno));
        exit(1);
    }
    watched = exception;
    fputs("cycles,t_s,address,instruction_cycles\n", file);
}

void irqpath_entered(unsigned exception, unsigned entry_cycles, double t_s)
{
    if (inside > 0) {
        inside++;
        disturbed = true;
    } else if (file && exception == watched) {
        inside = 1;
        disturbed = false;
        length = 0;
        begin = cycles_total().high - entry_cycles;
        begin_s = t_s;
    }
}

void irqpath_executing(uint32_t address)
{
    if (inside == 1 && length < LONGEST_WAY) {
        way[length++] = (struct visit){address, cycles_total().high};
    }
}

static bool is_known(uint64_t cycles)
{
    for (size_t n = 0; n < known_count; n++) {
        if (known[n] == cycles) {
            return true;
        }
    }
    return known_count == DURATIONS;
}

void irqpath_returned(void)
{
    if (inside == 0 || --inside > 0) {
        return;
    }
    uint64_t end = cycles_total().high, cycles = end - begin;
    if (disturbed || length == LONGEST_WAY || is_known(cycles)) {
        return;
    }
    known[known_count++] = cycles;
    for (size_t n = 0; n < length; n++) {
        uint64_t next = n + 1 < length ? way[n + 1].at : end;
        fprintf(file, "%" PRIu64 ",%.9f,0x%08" PRIx32 ",%" PRIu64 "\n", cycles, begin_s, way[n].address,
                next - way[n].at);
    }
}

void irqpath_reset(void)
{
    inside = 0;
}
