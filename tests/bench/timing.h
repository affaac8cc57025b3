/* SPDX-License-Identifier: MIT */
/*
 * Timing one call with the core's cycle counter, and what many calls come to.
 *
 * A call is timed between two readings of CYCCNT, with interrupts masked. What the readings themselves cost is measured
 * too, around one NOP, and taken off; so the figure of a call is BL, the function and its return, and a function that does
 * nothing takes four cycles. Where CYCCNT counts something else, the figures are in its unit.
 */
#ifndef TESTS_BENCH_TIMING_H
#define TESTS_BENCH_TIMING_H

#include <stdint.h>

#include "drivers/cortex/cpu.h"
#include "drivers/cortex/dwt.h"

/* Reads its arguments from `in`, writes its results to `out`, and returns the difference of the two readings. */
typedef uint32_t (*timer_function)(const void *in, void *out);

/*
 * Defines a timer_function around `call`. It begins on 8 bytes, so that the flash's and the fetch buffer's part is the
 * same in all of them. The barriers keep the call, which may touch no volatile object, between the readings.
 */
#define TIMING_FUNCTION(name, call) \
    static __attribute__((noinline, aligned(8))) uint32_t name(const void *in, void *out) \
    { \
        const uint32_t start = dwt_cycles(); \
        (void)in; \
        (void)out; \
        cpu_compiler_barrier(); \
        call; \
        cpu_compiler_barrier(); \
        return dwt_cycles() - start; \
    }

/* Puts code where the cache is locked, for what it times is there too: nothing else of this image is (m2s010.ld). */
#define TIMING_LOCKED __attribute__((section(".text.timed")))

/* Typical data decide the median; extreme data count for the smallest and largest only. */
#define TIMING_TYPICAL 255u

struct timing {
    uint32_t typical[TIMING_TYPICAL];
    uint32_t count; /* of them */
    uint32_t min, max;
};

struct timing_figures {
    uint32_t min, median, max;
};

/* Measures what two readings cost. Once, before the others. */
void timing_init(void);

/* What timing_init() found. */
uint32_t timing_overhead(void);

/* One timed call with interrupts masked, less the overhead. Refreshes the watchdog. */
uint32_t timing_once(timer_function timer, const void *in, void *out);

void timing_begin(struct timing *t);
void timing_add_typical(struct timing *t, uint32_t value);
void timing_add_extreme(struct timing *t, uint32_t value);

/* Sorts the typical values. */
struct timing_figures timing_figures(struct timing *t);

#endif
