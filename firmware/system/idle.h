/* SPDX-License-Identifier: MIT */
/* What the thread does while it has nothing to do: serves the watchdog as long as the interrupts live, and sleeps. */
#ifndef FIRMWARE_SYSTEM_IDLE_H
#define FIRMWARE_SYSTEM_IDLE_H

#include <stdint.h>

struct idle {
    const volatile uint32_t *time_ms; /* a clock that the slow loop moves */
    uint32_t served_ms;               /* what it said at the last refresh */
};

/* Sleeps until the next interrupt has been served. Thread only. */
void idle(struct idle *i);

/*
 * Refreshes the watchdog if the slow loop has moved its clock since the last time. Call it where the thread gets on with its
 * work, never where it waits. Thread only.
 */
void idle_serve_watchdog(struct idle *i);

#endif
