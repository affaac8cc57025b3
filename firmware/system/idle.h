/* SPDX-License-Identifier: MIT */
/* The idle thread: serves the watchdog while the slow loop runs, and sleeps. And the time that the current loop takes. */
#ifndef FIRMWARE_SYSTEM_IDLE_H
#define FIRMWARE_SYSTEM_IDLE_H

#include <stdint.h>

#define IDLE_LINES 3u
#define IDLE_AXES  2u /* at most */

struct idle {
    const volatile uint32_t *time_ms;              /* a clock that the slow loop advances */
    const volatile uint32_t *received[IDLE_LINES]; /* counters of characters received, per line */
    volatile uint32_t *progress_ms[IDLE_AXES]; /* of each axis: time of the thread's last progress, for its slow loop */
    uint32_t served_ms;                        /* the clock at the last refresh */
    uint32_t seen_ms, seen[IDLE_LINES];        /* clock and counters when the thread last resumed */
};

/*
 * Sleeps until the clock or a line's counter changes; not at all if one has changed since the last call. Other interrupts,
 * mainly the current loop's, wake the processor but not the thread. A change just before the processor sleeps is noticed at the
 * next interrupt of any kind. Thread only.
 */
void idle(struct idle *i);

/*
 * Refreshes the watchdog, and reports progress to each slow loop, if the slow loop has advanced its clock since the last call.
 * Call it where the thread makes progress, never where it waits. Thread only.
 */
void idle_serve_watchdog(struct idle *i);

/*
 * Cycles that one current-loop interrupt takes from the thread, entry and exit included. `time_ms` is a clock that the slow
 * loop advances. Thread; busy for two PWM periods, or a few times that if the slow loop comes in between.
 */
uint32_t measure_current_loop_cycles(const volatile uint32_t *time_ms);

#endif
