/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "drivers/cortex/nvic.h"
#include "drivers/mss/watchdog.h"
#include "firmware/settings/config.h"
#include "startup/startup.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"

#define IRQ_EMPTY MSS_IRQ_FABRIC(1u)
#define IRQ_STAMP MSS_IRQ_FABRIC(2u)
#define ROUNDS    15u

static volatile uint32_t stamp;

void FabricIrq1_IRQHandler(void)
{
}

void FabricIrq2_IRQHandler(void)
{
    stamp = dwt_cycles();
}

/* From before the request to after it has been served, or has not because it is disabled. */
static TIMING_LOCKED __attribute__((noinline, aligned(8))) uint32_t pend(volatile uint32_t *set_pending, uint32_t bit)
{
    const uint32_t start = dwt_cycles();
    *set_pending = bit;
    cpu_dsb();
    cpu_isb();
    return dwt_cycles() - start;
}

static uint32_t pend_irq(uint32_t irq)
{
    watchdog_refresh();
    const uint32_t mask = cpu_mask_below(CONFIG_PRIORITY_CONSOLE); /* what is timed is more urgent than the console */
    const uint32_t cycles = pend(&NVIC->ISPR[irq / 32u], 1u << (irq % 32u));
    (void)cpu_mask_below(mask);
    return cycles;
}

uint32_t rows_time_interrupt(uint32_t irq)
{
    nvic_disable(irq);
    const uint32_t without = pend_irq(irq);
    nvic_clear_pending(irq);
    nvic_enable(irq);
    return pend_irq(irq) - without;
}

static void row_round_trip(void)
{
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < ROUNDS; i++) {
        timing_add_typical(&rows_timing, rows_time_interrupt(IRQ_EMPTY));
    }
    rows_print("interrupt.round_trip");
}

/* The reading before the request and the one in the handler; the store and the handler's first load are part of it. */
static void row_latency(void)
{
    nvic_enable(IRQ_STAMP);
    const uint32_t mask = cpu_mask_below(CONFIG_PRIORITY_CONSOLE);
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < ROUNDS; i++) {
        const uint32_t start = dwt_cycles();
        NVIC->ISPR[IRQ_STAMP / 32u] = 1u << (IRQ_STAMP % 32u);
        cpu_dsb();
        cpu_isb();
        timing_add_typical(&rows_timing, stamp - start - timing_overhead());
    }
    (void)cpu_mask_below(mask);
    nvic_disable(IRQ_STAMP);
    rows_print("interrupt.latency");
}

void rows_interrupt(void)
{
    print_heading("the core: request to the first reading in the handler; entry and exit around an empty handler");
    row_latency();
    row_round_trip();
}
