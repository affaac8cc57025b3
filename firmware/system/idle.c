/* SPDX-License-Identifier: MIT */
#include "firmware/system/idle.h"

#include "drivers/cortex/cpu.h"
#include "drivers/mss/watchdog.h"

/*
 * A refresh needs both sides alive: the thread, which is here, and the slow loop, whose time must have moved on. The slow loop
 * in turn watches the current loop.
 */
void idle_serve_watchdog(struct idle *i)
{
    const uint32_t now_ms = *i->time_ms;
    if (now_ms != i->served_ms) {
        i->served_ms = now_ms;
        watchdog_refresh();
    }
}

void idle(struct idle *i)
{
    idle_serve_watchdog(i);
    cpu_wait_for_interrupt();
}
