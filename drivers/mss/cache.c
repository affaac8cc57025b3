/* SPDX-License-Identifier: MIT */
#include "drivers/mss/cache.h"

#include "drivers/cortex/cpu.h"
#include "drivers/mss/sysreg.h"

/* Its own fetches would take lines of the cache, and while the lock is in doubt nothing may come from there. */
#define IN_ESRAM __attribute__((section(".ramcode"), noinline))

static inline __attribute__((always_inline)) void cache_begin(uint32_t control)
{
    SYSREG->CC_CR = 0u;
    SYSREG->FLUSH_CR = SYSREG_FLUSH_CACHE;
    SYSREG->CC_CR = control;
    cpu_dsb();
    cpu_isb();
}

IN_ESRAM bool cache_lock(const volatile uint32_t *code, const volatile uint32_t *array)
{
    SYSREG->CC_REGION_CR |= SYSREG_CC_REGION_CODE_0;
    SYSREG->MASTER_WEIGHT0_CR &= ~SYSREG_WEIGHT_IC; /* 0 is 32: no other master comes between the words of a line */
    cache_begin(SYSREG_CC_CR_ENABLE);
    for (uint32_t word = 0; word < CACHE_BYTES / 4u; word += CACHE_LINE_BYTES / 4u) {
        (void)code[word]; /* a miss each, in order: a line each, way by way */
    }
    SYSREG->CC_CR = SYSREG_CC_CR_ENABLE | SYSREG_CC_CR_LOCK;
    cpu_dsb();
    const bool locked = (SYSREG->CC_CR & SYSREG_CC_CR_LOCK) != 0u; /* a design may have made the register read-only */
    bool same = true;
    for (uint32_t word = 0; word < CACHE_BYTES / 4u; word++) {
        same = same && code[word] == array[word];
    }
    if (!same) {
        cache_begin(0u); /* slow, but what runs is what was programmed */
    }
    return locked && same;
}
