/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles_fetch.h"

#define BUFFER_WORDS 3u

static unsigned envm_wait, esram_wait;
static uint32_t last;                /* number of the word fetched last */
static uint64_t complete;            /* when it was there */
static uint64_t taken[BUFFER_WORDS]; /* when the core took a word out of its place in the buffer */

void cycles_fetch_init(unsigned envm, unsigned esram)
{
    envm_wait = envm;
    esram_wait = esram;
}

static unsigned wait_of(uint32_t address)
{
    return address >> 28 == 2 ? esram_wait : envm_wait;
}

static uint64_t later(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

static uint64_t wait_for(uint32_t word, uint64_t now, unsigned wait)
{
    while (last != word) {
        last++;
        complete = later(complete, taken[last % BUFFER_WORDS]) + 1 + wait;
    }
    uint64_t start = later(complete, now);
    taken[word % BUFFER_WORDS] = start;
    return start - now;
}

uint64_t cycles_fetch_restart(uint32_t address, unsigned size, uint64_t now)
{
    unsigned wait = wait_of(address);
    if (wait == 0) {
        return 0;
    }
    last = address / 4;
    complete = now + wait;
    for (unsigned n = 0; n < BUFFER_WORDS; n++) {
        taken[n] = now;
    }
    uint64_t waited = wait_for((address + size - 1) / 4, now, wait);
    /* The second word's own cycle is RULE_TARGET_SPLIT. */
    return waited - ((address + size - 1) / 4 != address / 4);
}

uint64_t cycles_fetch(uint32_t address, unsigned size, uint64_t now)
{
    unsigned wait = wait_of(address);
    return wait == 0 ? 0 : wait_for((address + size - 1) / 4, now, wait);
}
