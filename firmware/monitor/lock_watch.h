/* SPDX-License-Identifier: MIT */
/*
 * Without an encoder: whether what gives the angle still has the rotor. Switches, prescribed field, injection and observer each
 * have their own signs of it; the last three are here, the switches' in hall_watch.h.
 */
#ifndef FIRMWARE_MONITOR_LOCK_WATCH_H
#define FIRMWARE_MONITOR_LOCK_WATCH_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

/* ---- a prescribed field ---- */

/*
 * Detects, from the EMF alone, whether the rotor still follows a prescribed field. With the rotor behind the field by lambda,
 * in the field's frame and for either direction of rotation:
 *
 *     e = v - R i - j w Lq i = |w| psi (sin lambda, cos lambda)        (axes d and q; q counted along w)
 *
 * A rotor that has pulled out turns at another speed than the field, or not at all: its EMF rotates in this frame, or vanishes.
 * Each millisecond adds points for that or takes one away; sixty milliseconds without EMF are enough, and somewhat more of a
 * rotating EMF. Resistance and dead time act along the current and leave the q component alone: it must be there, a quarter of
 * the whole; or, if the load angle is too large for that, d must exceed what may be hidden.
 * A rotor that a load drives much faster than the field has more EMF than both say. Active flux: control/observer.h.
 */
struct field_watch {
    int32_t d_q4, q_q4;  /* e, filtered; 4 more bits */
    int32_t expected_q4; /* |w| psi, with the same filter */
    int32_t out;         /* points: each millisecond adds or subtracts */
};

#define FIELD_WATCH_POINTS 120 /* this many are a fault */

/* True if the rotor may be out of step already: other anomalies are then not the cause. Slow loop. */
static inline bool field_watch_doubts(const struct field_watch *w)
{
    return w->out > FIELD_WATCH_POINTS / 4;
}

/* One step while the field leads; may report a fault. Slow loop, each millisecond of operation. */
void field_watch_step(struct axis *a);

/* Forgets what was seen: the observer leads, or nothing turns yet. Slow loop. */
void field_watch_reset(struct field_watch *w);

/* ---- all of them ---- */

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
