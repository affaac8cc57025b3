/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles_fetch.h"

#include "cycles_cache.h"

#define BUFFER_WORDS 3u

static bool envm_waits;
static unsigned esram_wait;
static uint32_t last;                /* number of the word fetched last */
static unsigned place;               /* of it in the buffer */
static uint64_t complete;            /* when it was there */
static uint64_t taken[BUFFER_WORDS]; /* when the core took a word out of its place in the buffer */

void cycles_fetch_init(bool envm, unsigned esram)
{
    envm_waits = envm;
    esram_wait = esram;
}

static bool is_esram(uint32_t address)
{
    return address >> 28 == 2;
}

static bool may_wait(uint32_t address)
{
    return is_esram(address) || envm_waits;
}

/* A word's cycles beyond the one of an access that is answered at once. The core registers a fetch over the system bus. */
static unsigned wait_of(uint32_t address)
{
    return is_esram(address) ? 1 + esram_wait : cycles_cache_waits(address);
}

static uint64_t later(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

static uint64_t wait_for(uint32_t word, uint64_t now)
{
    while (last != word) {
        last++;
        place = place + 1 < BUFFER_WORDS ? place + 1 : 0;
        complete = later(complete, taken[place]) + 1 + wait_of(last * 4);
    }
    uint64_t start = later(complete, now);
    taken[place] = start;
    return start - now;
}

void cycles_fetch_give_way(uint64_t cycles)
{
    if (is_esram(last * 4)) {
        complete += cycles;
    }
}

uint64_t cycles_fetch_restart(uint32_t address, unsigned size, uint64_t now)
{
    if (!may_wait(address)) {
        return 0;
    }
    last = address / 4;
    complete = now + wait_of(address);
    for (unsigned n = 0; n < BUFFER_WORDS; n++) {
        taken[n] = now;
    }
    uint64_t waited = wait_for((address + size - 1) / 4, now);
    /* The second word's own cycle is RULE_TARGET_SPLIT. */
    return waited - ((address + size - 1) / 4 != address / 4);
}

uint64_t cycles_fetch(uint32_t address, unsigned size, uint64_t now)
{
    return may_wait(address) ? wait_for((address + size - 1) / 4, now) : 0;
}
