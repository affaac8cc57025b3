/* SPDX-License-Identifier: MIT */
/*
 * Core instructions that C cannot express: masking, barriers, sleep. ARMv7-M ARM, B1.4 and A7.7.
 * Context of all of them: any, privileged (this project never leaves privileged mode).
 */
#ifndef DRIVERS_CORTEX_CPU_H
#define DRIVERS_CORTEX_CPU_H

#include <stdint.h>

#include "drivers/mss/irq.h"

/* Masks all interrupts of configurable priority; returns what cpu_irq_restore() needs, so pairs nest. */
static inline uint32_t cpu_irq_save(void)
{
    uint32_t primask;
    __asm volatile("mrs %0, primask\n\tcpsid i" : "=r"(primask) : : "memory");
    return primask;
}

static inline void cpu_irq_restore(uint32_t primask)
{
    __asm volatile("msr primask, %0" : : "r"(primask) : "memory");
}

static inline void cpu_irq_enable(void)
{
    __asm volatile("cpsie i" : : : "memory");
}

static inline void cpu_irq_disable(void)
{
    __asm volatile("cpsid i" : : : "memory");
}

/*
 * Masks interrupts of priority `level` and less urgent ones (larger numbers), level 1...15; the more urgent keep
 * running. 0 masks nothing. Returns the level before, to put back.
 */
static inline uint32_t cpu_mask_below(uint32_t level)
{
    uint32_t before;
    __asm volatile("mrs %0, basepri\n\tmsr basepri, %1"
                   : "=&r"(before)
                   : "r"((level & MSS_IRQ_PRIORITY_LOWEST) << MSS_IRQ_PRIORITY_SHIFT)
                   : "memory");
    return before >> MSS_IRQ_PRIORITY_SHIFT;
}

/* Waits until an interrupt is pending, also one that PRIMASK holds back. */
static inline void cpu_wait_for_interrupt(void)
{
    __asm volatile("dsb\n\twfi" : : : "memory");
}

/* Adds to a word that an interrupt also changes; retries if interrupted in between. ARMv7-M ARM, A3.4. */
static inline void cpu_add(volatile int32_t *word, int32_t summand)
{
    int32_t sum;
    uint32_t failed;
    do {
        __asm volatile("ldrex %0, [%2]\n\tadd %0, %3\n\tstrex %1, %0, [%2]"
                       : "=&r"(sum), "=&r"(failed)
                       : "r"(word), "r"(summand)
                       : "memory");
    } while (failed != 0u);
}

/* All earlier memory accesses are complete, not just ordered. */
static inline void cpu_dsb(void)
{
    __asm volatile("dsb" : : : "memory");
}

/* Instructions after this are fetched under the new configuration. */
static inline void cpu_isb(void)
{
    __asm volatile("isb" : : : "memory");
}

/* The compiler keeps memory accesses on their side. Enough between thread and ISR: one core, in order. */
static inline void cpu_compiler_barrier(void)
{
    __asm volatile("" : : : "memory");
}

#endif
