/* SPDX-License-Identifier: MIT */
#include "firmware/system/measure.h"

#include "drivers/cortex/dwt.h"
#include "firmware/settings/config.h"
#include "lib/q15.h"

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
