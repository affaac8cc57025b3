/* SPDX-License-Identifier: MIT */
/* What memory, bus and exceptions cost: B06 to B09. Each kernel runs twice, and the second time counts. */
#include "drivers/bringup/bringup.h"
#include "drivers/bringup/measure.h"
#include "drivers/cortex/nvic.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/cache.h"
#include "startup/startup.h"

#define LOAD_CYCLES  2u
#define STORE_CYCLES 1u
#define LINE_BYTES   32u
#define LINES        512u /* twice what the cache holds: each of them is gone when its turn comes again */
#define CLEAR_BYTES  2048u

/* Average of a kernel's accesses, rounded. */
static uint32_t each(uint32_t cycles)
{
    return (cycles - MEASURE_LOOK + MEASURE_ACCESSES / 2u) / MEASURE_ACCESSES;
}

static uint32_t beyond(uint32_t cycles, uint32_t nominal)
{
    return cycles > nominal ? cycles - nominal : 0u;
}

static uint32_t clear_all(void)
{
    uint32_t room[CLEAR_BYTES / 4u];
    uint32_t *const end = room + CLEAR_BYTES / 4u;
    const uint32_t bytes = (uint32_t)((uintptr_t)link_ram_end - (uintptr_t)link_ram_start);
    (void)measure_clear(room, end);
    return (measure_clear(room, end) - MEASURE_LOOK) * (bytes / CLEAR_BYTES);
}

void step_esram(struct bringup *b)
{
    const void *self = &self;
    uint32_t word = 0;
    (void)measure_chase(self);
    report(b, FACT_ESRAM_LOAD, each(measure_chase(self)));
    (void)measure_stores(&word);
    report(b, FACT_ESRAM_STORE, each(measure_stores(&word)));
    (void)measure_fetches();
    report(b, FACT_ESRAM_FETCH, each(measure_fetches()));
    report(b, FACT_CLEAR, clear_all());
}

/* The same loop over a line that is there, and over lines that are not. */
static uint32_t miss_waits(void)
{
    const void *const start = (const void *)(uintptr_t)startup_vectors[1];
    const void *const line = (const void *)((uintptr_t)start & ~(uintptr_t)(LINE_BYTES - 1u));
    (void)measure_strides(line, 0u, LINES);
    const uint32_t hits = measure_strides(line, 0u, LINES);
    (void)measure_strides(line, LINE_BYTES, LINES);
    return (measure_strides(line, LINE_BYTES, LINES) - hits + LINES / 2u) / LINES;
}

/* Locked, as the drive's start-up does it, and then as it was. */
static void report_lock(struct bringup *b)
{
    const void *const beyond = (const void *)((uintptr_t)link_code + CACHE_BYTES);
    const uint32_t hits = measure_strides(link_code, 0u, LINES);
    report(b, FACT_LOCKED, cache_lock(link_code, link_array) ? 1u : 0u);
    report(b, FACT_LOCKED_LOAD, (measure_strides(link_code, 0u, LINES) - hits + LINES / 2u) / LINES);
    report(b, FACT_BEYOND_LOAD, (measure_strides(beyond, 0u, LINES) - hits + LINES / 2u) / LINES);
    SYSREG->CC_CR = SYSREG_CC_CR_ENABLE;
}

void step_envm_cycles(struct bringup *b)
{
    static const void *const self = &self;
    (void)measure_chase_from_esram(self);
    report(b, FACT_HIT, beyond(each(measure_chase_from_esram(self)), LOAD_CYCLES));
    report(b, FACT_MISS, miss_waits());
    report(b, FACT_UNCACHED, beyond(each(b->found.uncached_cycles), LOAD_CYCLES));
    report_lock(b);
    report(b, FACT_ENVM_CR, SYSREG->ENVM_CR);
}

void step_fic(struct bringup *b)
{
    volatile uint32_t *const control = &FABRIC0->gate.CONTROL; /* takes a 0 at any time */
    if (!fabric_is_ours()) {
        report_text("B08", "left out: the fabric is not the one of docs/fabric.md, see B13");
        return;
    }
    b->found.fabric = FABRIC0->pwm.PERIOD; /* before anybody writes to it */
    (void)measure_loads(control);
    report(b, FACT_FIC_READ, beyond(each(measure_loads(control)), LOAD_CYCLES + 1u));
    (void)measure_stores(control);
    report(b, FACT_FIC_WRITE, beyond(each(measure_stores(control)), STORE_CYCLES));
    (void)measure_reads_behind_writes(control);
    report(b, FACT_FIC_READ_BEHIND,
           beyond(each(measure_reads_behind_writes(control)), STORE_CYCLES + LOAD_CYCLES + 1u));
}

void step_exceptions(struct bringup *b)
{
    uint32_t look[LOOKS];
    measure_exceptions(look);
    measure_exceptions(look);
    report(b, FACT_ENTRY, look[LOOK_ENTERED] - look[LOOK_BEFORE] - MEASURE_LOOK);
    report(b, FACT_EXIT, look[LOOK_BACK] - look[LOOK_CHAINED] - MEASURE_LOOK);
    report(b, FACT_TAIL_CHAIN, look[LOOK_CHAINED] - look[LOOK_LEAVING] - MEASURE_LOOK);
    (void)measure_loads(&NVIC->ISER[0]);
    report(b, FACT_PPB_READ, beyond(each(measure_loads(&NVIC->ISER[0])), LOAD_CYCLES + 1u));
}
