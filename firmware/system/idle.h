/* SPDX-License-Identifier: MIT */
/* What the thread does while it has nothing to do: serves the watchdog as long as the interrupts live, and sleeps. */
#ifndef FIRMWARE_SYSTEM_IDLE_H
#define FIRMWARE_SYSTEM_IDLE_H

#include <stdint.h>

#define IDLE_LINES 2u

struct idle {
    const volatile uint32_t *time_ms;           /* a clock that the slow loop moves */
    const volatile uint32_t *heard[IDLE_LINES]; /* counts that move with each character from a line */
    uint32_t served_ms;                         /* what the clock said at the last refresh */
    uint32_t seen_ms, seen[IDLE_LINES];         /* what clock and counts said when the thread was last let go */
};

/*
 * Sleeps until the clock or a line has something new; not at all if that came since the last call. What else interrupts,
 * the current loop above all, ends the processor's sleep and not the thread's. What comes as the processor falls asleep waits
 * for the next interrupt of any kind. Thread only.
 */
void idle(struct idle *i);

/*
 * Refreshes the watchdog if the slow loop has moved its clock since the last time. Call it where the thread gets on with its
 * work, never where it waits. Thread only.
 */
void idle_serve_watchdog(struct idle *i);

#endif
