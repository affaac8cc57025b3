/* SPDX-License-Identifier: MIT */
#include "tests/bench/timing.h"

#include "drivers/mss/watchdog.h"

#define NOP_CYCLES 1u

TIMING_FUNCTION(time_nop, __asm volatile("nop"))

static uint32_t overhead;

void timing_init(void)
{
    overhead = 0u;
    overhead = timing_once(time_nop, 0, 0) - NOP_CYCLES;
}

uint32_t timing_overhead(void)
{
    return overhead;
}

uint32_t timing_once(timer_function timer, const void *in, void *out)
{
    watchdog_refresh();
    const uint32_t mask = cpu_irq_save();
    const uint32_t counted = timer(in, out);
    cpu_irq_restore(mask);
    return counted - overhead;
}

void timing_begin(struct timing *t)
{
    t->count = 0u;
    t->min = UINT32_MAX;
    t->max = 0u;
}

void timing_add_extreme(struct timing *t, uint32_t value)
{
    t->min = value < t->min ? value : t->min;
    t->max = value > t->max ? value : t->max;
}

void timing_add_typical(struct timing *t, uint32_t value)
{
    timing_add_extreme(t, value);
    if (t->count < TIMING_TYPICAL) {
        t->typical[t->count++] = value;
    }
}

static void sort(uint32_t *values, uint32_t count)
{
    for (uint32_t sorted = 1u; sorted < count; sorted++) {
        const uint32_t value = values[sorted];
        uint32_t place = sorted;
        for (; place > 0u && values[place - 1u] > value; place--) {
            values[place] = values[place - 1u];
        }
        values[place] = value;
    }
}

struct timing_figures timing_figures(struct timing *t)
{
    sort(t->typical, t->count);
    return (struct timing_figures){t->min, t->typical[t->count / 2u], t->max};
}
