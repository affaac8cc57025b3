/* SPDX-License-Identifier: MIT */
#include "firmware/system/idle.h"

#include <stdint.h>

#include "drivers/cortex/cpu.h"
#include "drivers/mss/watchdog.h"
#include "firmware/system/axes.h"

void idle(void)
{
    /*
     * A refresh needs both sides alive: the thread, which is here, and the slow loop, whose time must have moved on. The
     * slow loop in turn watches the current loop.
     */
    static uint32_t served_ms;
    const uint32_t now_ms = axes[0].time_ms;
    if (now_ms != served_ms) {
        served_ms = now_ms;
        watchdog_refresh();
    }
    cpu_wait_for_interrupt();
}
