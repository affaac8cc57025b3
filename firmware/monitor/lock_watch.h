/* SPDX-License-Identifier: MIT */
/*
 * Without an encoder: whether what gives the angle still has the rotor. Switches, prescribed field, injection and observer each
 * have their own signs of it; the last two are here.
 */
#ifndef FIRMWARE_MONITOR_LOCK_WATCH_H
#define FIRMWARE_MONITOR_LOCK_WATCH_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

struct lock_watch {
    uint32_t source;  /* enum loop_source that `lost_ms` is about */
    uint32_t lost_ms; /* how long it has contradicted itself */
};

/* Starts afresh. Slow loop, when operation begins. */
void lock_watch_begin(struct lock_watch *w);

/*
 * True if the observer or the injection contradicts itself now: currents are commanded along an angle that may be wrong, so
 * other anomalies are not the cause. Lock lost will be reported soon. Slow loop.
 */
bool lock_watch_doubts(const struct axis *a);

/* One millisecond of operation without an encoder; returns false if it has just reported the rotor lost. Slow loop. */
bool lock_watch_step(struct axis *a);

#endif
