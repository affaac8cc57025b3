/* SPDX-License-Identifier: MIT */
/* The core's instructions on this machine: nothing interrupts a unit test, so masking is only counted. */
#ifndef TESTS_UNIT_HOST_CPU_H
#define TESTS_UNIT_HOST_CPU_H

#include <stdint.h>

extern uint32_t host_primask, host_basepri, host_sleeps;

/* Called in place of a wait for an interrupt: a test lets time pass here. */
extern void (*host_on_sleep)(void);

/* Called before interrupts below a level are held back, 0 lets them come: a test may be such an interrupt. */
extern void (*host_on_mask)(uint32_t level);

static inline uint32_t cpu_irq_save(void)
{
    const uint32_t before = host_primask;
    host_primask = 1u;
    return before;
}

static inline void cpu_irq_restore(uint32_t primask)
{
    host_primask = primask;
}

static inline void cpu_irq_enable(void)
{
    host_primask = 0u;
}

static inline void cpu_irq_disable(void)
{
    host_primask = 1u;
}

static inline uint32_t cpu_mask_below(uint32_t level)
{
    const uint32_t before = host_basepri;
    if (host_on_mask != 0) {
        host_on_mask(level);
    }
    host_basepri = level & 15u;
    return before;
}

static inline void cpu_wait_for_interrupt(void)
{
    host_sleeps++;
    if (host_on_sleep != 0) {
        host_on_sleep();
    }
}

static inline void cpu_add(volatile int32_t *word, int32_t summand)
{
    *word = (int32_t)((uint32_t)*word + (uint32_t)summand); /* wraps, as the core's instruction does */
}

static inline void cpu_dsb(void)
{
}

static inline void cpu_isb(void)
{
}

static inline void cpu_compiler_barrier(void)
{
}

#endif
