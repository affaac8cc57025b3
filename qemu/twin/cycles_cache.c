/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles_cache.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cycles_price.h"
#include "sysreg.h"

#define SETS       64u
#define WAYS       4u
#define LINE_BYTES 32u
#define WORD_BYTES 4u
#define READ_BYTES 8u /* of eNVM, at once */
#define ENABLED    1u
#define LOCKED     4u

static bool as_device;
static unsigned envm_wait, miss_wait;
static uint32_t line[SETS][WAYS]; /* number of the line and 1, 0: none; the newest first */
static unsigned flushes;          /* that it has seen */
static uint32_t read_last;        /* the word that eNVM was asked for last */

void cycles_cache_init(const struct cycles_params *p)
{
    as_device = p->cache == CYCLES_CACHE_DEVICE;
    envm_wait = cycles_envm_waits(p);
    miss_wait = (unsigned)p->cache_miss;
}

void cycles_cache_reset(void)
{
    memset(line, 0, sizeof line);
    read_last = 0;
}

void cycles_cache_evict(void)
{
    if ((sysreg_value(SYSREG_CC_CR) & LOCKED) == 0) {
        cycles_cache_reset();
    }
}

static unsigned way_of(uint32_t number)
{
    const uint32_t *set = line[number % SETS];
    unsigned way = 0;
    while (way < WAYS && set[way] != number + 1) {
        way++;
    }
    return way;
}

/* Whether it was there. It is now, and the newest. */
static bool take(uint32_t number)
{
    uint32_t *set = line[number % SETS];
    const unsigned found = way_of(number), way = found < WAYS ? found : WAYS - 1;
    memmove(set + 1, set, way * sizeof *set);
    set[0] = number + 1;
    return found < WAYS;
}

static unsigned beyond_cache(uint32_t address)
{
    const uint32_t word = address / WORD_BYTES;
    const bool second = word % (READ_BYTES / WORD_BYTES) != 0 && read_last + 1 == word;
    read_last = word;
    return second ? 0 : envm_wait;
}

/* The lock asks for no line: what was not copied before it was set reads as whatever the cache held. */
static unsigned locked(uint32_t address)
{
    if (address >= CYCLES_CACHE_BYTES) {
        return beyond_cache(address);
    }
    if (way_of(address / LINE_BYTES) == WAYS) {
        fprintf(stderr, "mssfoc twin: the cache was locked without the line of %#x: the core reads garbage there\n",
                address);
        exit(1);
    }
    return 0;
}

unsigned cycles_cache_waits(uint32_t address)
{
    if (!as_device) {
        return envm_wait;
    }
    const uint32_t control = sysreg_value(SYSREG_CC_CR);
    if (flushes != sysreg_cache_flushes()) {
        flushes = sysreg_cache_flushes();
        memset(line, 0, sizeof line);
    }
    if ((control & ENABLED) == 0) {
        return beyond_cache(address);
    }
    if ((control & LOCKED) != 0) {
        return locked(address);
    }
    return take(address / LINE_BYTES) ? 0 : miss_wait;
}
