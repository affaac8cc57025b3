/* SPDX-License-Identifier: MIT */
/*
 * Nested vectored interrupt controller. ARMv7-M ARM, B3.4. This device: 82 interrupts, 4 bits of priority
 * (0 most urgent ... 15), all of them preemption priority.
 *
 * All functions: context any; an interrupt number of MSS_IRQ_COUNT or more does nothing (and reads as "no").
 */
#ifndef DRIVERS_CORTEX_NVIC_H
#define DRIVERS_CORTEX_NVIC_H

#include "drivers/cortex/cpu.h"
#include "drivers/mss/irq.h"
#include "drivers/reg.h"

struct nvic_regs {
    volatile uint32_t ISER[8]; /* set enable */
    uint32_t reserved_20[24];
    volatile uint32_t ICER[8]; /* clear enable */
    uint32_t reserved_a0[24];
    volatile uint32_t ISPR[8]; /* set pending */
    uint32_t reserved_120[24];
    volatile uint32_t ICPR[8]; /* clear pending */
    uint32_t reserved_1a0[24];
    volatile uint32_t IABR[8]; /* active */
    uint32_t reserved_220[56];
    volatile uint8_t IPR[240]; /* priorities, one byte each, in the upper four bits */
    uint32_t reserved_3f0[644];
    volatile uint32_t STIR; /* software trigger */
};

REG_AT_OFFSET(struct nvic_regs, ISER, 0x000);
REG_AT_OFFSET(struct nvic_regs, ICER, 0x080);
REG_AT_OFFSET(struct nvic_regs, ISPR, 0x100);
REG_AT_OFFSET(struct nvic_regs, ICPR, 0x180);
REG_AT_OFFSET(struct nvic_regs, IABR, 0x200);
REG_AT_OFFSET(struct nvic_regs, IPR, 0x300);
REG_AT_OFFSET(struct nvic_regs, STIR, 0xE00);

#define NVIC REG_BLOCK(struct nvic_regs, 0xE000E100u)

/* Lets the interrupt through; if it is pending it is taken at once. */
static inline void nvic_enable(uint32_t irq)
{
    if (irq < MSS_IRQ_COUNT) {
        NVIC->ISER[irq / 32u] = 1u << (irq % 32u);
    }
}

/* Once this returns, the interrupt is not taken any more. */
static inline void nvic_disable(uint32_t irq)
{
    if (irq < MSS_IRQ_COUNT) {
        NVIC->ICER[irq / 32u] = 1u << (irq % 32u);
        cpu_dsb();
        cpu_isb();
    }
}

static inline bool nvic_is_enabled(uint32_t irq)
{
    return irq < MSS_IRQ_COUNT && ((NVIC->ISER[irq / 32u] >> (irq % 32u)) & 1u) != 0u;
}

/* level 0 (most urgent) ... 15; larger values are taken as 15. */
static inline void nvic_priority(uint32_t irq, uint32_t level)
{
    if (irq < MSS_IRQ_COUNT) {
        NVIC->IPR[irq] =
            (uint8_t)((level > MSS_IRQ_PRIORITY_LOWEST ? MSS_IRQ_PRIORITY_LOWEST : level) << MSS_IRQ_PRIORITY_SHIFT);
    }
}

/* Raises the interrupt by software; taken at once where priority and masks allow. */
static inline void nvic_pend(uint32_t irq)
{
    if (irq < MSS_IRQ_COUNT) {
        NVIC->ISPR[irq / 32u] = 1u << (irq % 32u);
        cpu_dsb();
        cpu_isb();
    }
}

/* Forgets a pending interrupt. A source that still asserts its line makes it pending again. */
static inline void nvic_clear_pending(uint32_t irq)
{
    if (irq < MSS_IRQ_COUNT) {
        NVIC->ICPR[irq / 32u] = 1u << (irq % 32u);
    }
}

static inline bool nvic_is_pending(uint32_t irq)
{
    return irq < MSS_IRQ_COUNT && ((NVIC->ISPR[irq / 32u] >> (irq % 32u)) & 1u) != 0u;
}

/* Being served, or preempted while being served. */
static inline bool nvic_is_active(uint32_t irq)
{
    return irq < MSS_IRQ_COUNT && ((NVIC->IABR[irq / 32u] >> (irq % 32u)) & 1u) != 0u;
}

#endif
