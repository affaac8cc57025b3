/* SPDX-License-Identifier: MIT */
#include "firmware/system/idle.h"

#include <stdbool.h>

#include "drivers/cortex/cpu.h"
#include "drivers/cortex/dwt.h"
#include "drivers/mss/watchdog.h"
#include "firmware/settings/config.h"
#include "lib/q15.h"

/*
 * A refresh requires the thread, which runs here, and the slow loop, whose clock must have advanced. The slow loop monitors the
 * current loop, and the thread by the time of progress written here.
 */
void idle_serve_watchdog(struct idle *i)
{
    const uint32_t now_ms = *i->time_ms;
    if (now_ms == i->served_ms) {
        return;
    }
    i->served_ms = now_ms;
    watchdog_refresh();
    for (uint32_t n = 0; n < IDLE_AXES; n++) {
        *i->progress_ms[n] = now_ms;
    }
}

/* True if the clock or a counter has changed; updates the copies. */
static bool has_news(struct idle *i)
{
    const uint32_t now_ms = *i->time_ms;
    bool moved = now_ms != i->seen_ms;
    i->seen_ms = now_ms;
    for (uint32_t n = 0; n < IDLE_LINES; n++) {
        const uint32_t received = *i->received[n];
        moved = moved || received != i->seen[n];
        i->seen[n] = received;
    }
    return moved;
}

void idle(struct idle *i)
{
    idle_serve_watchdog(i);
    while (!has_news(i)) {
        cpu_wait_for_interrupt();
    }
}

/* ==== what the current loop takes ==== */

/*
 * The longest gap between counter reads contains the interrupt; subtract the shortest. The first gap does not count as the
 * shortest, because no turn of the loop is in it. Branch-free, since a branch would lengthen the next gap.
 */
static uint32_t longest_gap(void)
{
    const uint32_t start = dwt_cycles();
    uint32_t before = start;
    int32_t longest = 0;
    int32_t shortest = INT32_MAX;
    int32_t first = 100;
    while (before - start < 2u * CONFIG_PWM_COUNTS) {
        const uint32_t now = dwt_cycles();
        const int32_t gap = (int32_t)(now - before) + first;
        longest = q15_max(longest, gap);
        shortest = q15_min(shortest, gap);
        first = 0;
        before = now;
    }
    return (uint32_t)(longest - shortest);
}

uint32_t measure_current_loop_cycles(const volatile uint32_t *time_ms)
{
    uint32_t cycles = 0;
    for (unsigned attempt = 0; attempt < 4u; attempt++) {
        const uint32_t before_ms = *time_ms;
        cycles = longest_gap();
        if (*time_ms == before_ms) { /* or the slow loop was the longest */
            break;
        }
    }
    return cycles;
}
