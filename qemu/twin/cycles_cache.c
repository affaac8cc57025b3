/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles_cache.h"

#include <string.h>

#include "cycles_price.h"
#include "sysreg.h"

#define SETS       64u
#define WAYS       4u
#define LINE_BYTES 32u
#define CC_ENABLE  1u

static bool as_device;
static unsigned envm_wait, miss_wait;
static uint32_t line[SETS][WAYS]; /* number of the line and 1, 0: none; the newest first */

void cycles_cache_init(const struct cycles_params *p)
{
    as_device = p->cache == CYCLES_CACHE_DEVICE;
    envm_wait = cycles_envm_waits(p);
    miss_wait = (unsigned)p->cache_miss;
}

void cycles_cache_reset(void)
{
    memset(line, 0, sizeof line);
}

/* Whether it was there. It is now, and the newest. */
static bool take(uint32_t number)
{
    uint32_t *set = line[number % SETS], way = 0;
    while (way < WAYS - 1 && set[way] != number + 1) {
        way++;
    }
    bool hit = set[way] == number + 1;
    memmove(set + 1, set, way * sizeof *set);
    set[0] = number + 1;
    return hit;
}

unsigned cycles_cache_waits(uint32_t address)
{
    if (!as_device || (sysreg_value(SYSREG_CC_CR) & CC_ENABLE) == 0) {
        return envm_wait;
    }
    return take(address / LINE_BYTES) ? 0 : miss_wait;
}
