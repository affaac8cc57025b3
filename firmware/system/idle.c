/* SPDX-License-Identifier: MIT */
#include "firmware/system/idle.h"

#include <stdbool.h>

#include "drivers/cortex/cpu.h"
#include "drivers/mss/watchdog.h"

/*
 * A refresh needs both sides alive: the thread, which is here, and the slow loop, whose time must have moved on. The slow loop
 * in turn watches the current loop, and the thread, by the time that is left for it here.
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

/* Takes note of clock and counts; whether any of them has moved. */
static bool take_notice(struct idle *i)
{
    const uint32_t now_ms = *i->time_ms;
    bool moved = now_ms != i->seen_ms;
    i->seen_ms = now_ms;
    for (uint32_t n = 0; n < IDLE_LINES; n++) {
        const uint32_t heard = *i->heard[n];
        moved = moved || heard != i->seen[n];
        i->seen[n] = heard;
    }
    return moved;
}

void idle(struct idle *i)
{
    idle_serve_watchdog(i);
    while (!take_notice(i)) {
        cpu_wait_for_interrupt();
    }
}
