/* SPDX-License-Identifier: MIT */
/* The thread's time: it serves the watchdog as long as the interrupts live, and sleeps; and what an interrupt takes of it. */
#ifndef FIRMWARE_SYSTEM_IDLE_H
#define FIRMWARE_SYSTEM_IDLE_H

#include <stdint.h>

#define IDLE_LINES 3u
#define IDLE_AXES  2u /* at most */

struct idle {
    const volatile uint32_t *time_ms;           /* a clock that the slow loop advances */
    const volatile uint32_t *heard[IDLE_LINES]; /* counters, one up per character from a line */
    volatile uint32_t
        *progress_ms[IDLE_AXES];        /* where each axis's slow loop finds when the thread last made progress */
    uint32_t served_ms;                 /* the clock at the last refresh */
    uint32_t seen_ms, seen[IDLE_LINES]; /* clock and counts when the thread last resumed */
};

/*
 * Sleeps until the clock or a line has something new; not at all if something came since the last call. Other interrupts, above
 * all the current loop's, end the processor's sleep but not the thread's. What comes as the processor falls asleep waits for
 * the next interrupt of any kind. Thread only.
 */
void idle(struct idle *i);

/*
 * Refreshes the watchdog, and tells each slow loop of the progress, if the slow loop has advanced its clock since
 * the last time. Call it where the thread makes progress, never where it waits. Thread only.
 */
void idle_serve_watchdog(struct idle *i);

/*
 * Cycles that one current-loop interrupt takes from the thread, entry and exit included. `time_ms` is a clock that the slow
 * loop advances. Thread; busy for two PWM periods, or a few times that if the slow loop comes in between.
 */
uint32_t measure_current_loop_cycles(const volatile uint32_t *time_ms);

#endif
