/* SPDX-License-Identifier: MIT */
/* Runs the sequences of a table and compares what the cycle counter says with what was counted by hand. */
#include "drivers/cortex/cpu.h"
#include "drivers/cortex/dwt.h"
#include "drivers/cortex/nvic.h"
#include "drivers/mss/irq.h"
#include "drivers/mss/timer.h"
#include "tests/target/harness.h"

struct timing_row {
    const char *name;
    uint32_t (*run)(void); /* cycles, the frame's included */
    uint32_t expected;     /* or MEASURED: to be printed only */
};

#define MEASURED UINT32_MAX

/* The first row is the frame alone; the last has no name. */
extern const struct timing_row timing_table[];

uint32_t timing_buffer[16] __attribute__((aligned(64)));

/* Sleeps until the timer has run down, with its interrupt masked: it wakes the core, and no handler is entered. */
static uint32_t cycles_of_sleep(uint32_t timer_ticks)
{
    cpu_irq_disable();
    nvic_enable(MSS_IRQ_TIMER1);
    (void)mss_timer1_start_periodic(timer_ticks);
    const uint32_t start = dwt_cycles();
    cpu_wait_for_interrupt();
    const uint32_t cycles = dwt_cycles() - start;
    mss_timer1_stop();
    mss_timer1_acknowledge();
    nvic_disable(MSS_IRQ_TIMER1);
    nvic_clear_pending(MSS_IRQ_TIMER1);
    cpu_irq_enable();
    return cycles;
}

int main(void)
{
    (void)harness_begin();
    harness_true("the core has a cycle counter", dwt_init());
    timing_buffer[0] = (uint32_t)(uintptr_t)timing_buffer;
    const uint32_t frame = timing_table[0].run();
    harness_equal(timing_table[0].name, frame, timing_table[0].expected);
    for (const struct timing_row *row = &timing_table[1]; row->name != NULL; row++) {
        const uint32_t cycles = row->run() - frame;
        if (row->expected == MEASURED) {
            harness_note(row->name, cycles);
        } else {
            harness_equal(row->name, cycles, row->expected);
        }
    }
    harness_between("the counter stands still in sleep", cycles_of_sleep(100000u), 1u, 100u);
    harness_end();
}
