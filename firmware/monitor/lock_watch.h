/* SPDX-License-Identifier: MIT */
/*
 * Without an encoder: whether what gives the angle still has the rotor. Hall switches, prescribed field, injection and observer
 * each have their own signs of it.
 */
#ifndef FIRMWARE_MONITOR_LOCK_WATCH_H
#define FIRMWARE_MONITOR_LOCK_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"

struct axis;

/* ==== Hall switches ==== */

/*
 * Checks the Hall switches against themselves: a state that the table does not have means a broken wire or a switch without
 * supply; a skipped sector means a disturbance, or a rotor too fast for the sampling. A wire that breaks at standstill shows
 * when the rotor turns.
 *
 * A breaking wire adds an edge or hides one, up to half an electrical turn before it shows. So the rotor is tracked meanwhile,
 * for carrying on without the switches (drive/failover.h): once the angle is more than 15 degrees from what the earlier speed
 * predicts, that speed is extrapolated for an electrical turn. After that the switches are believed.
 *
 * Wires that are exchanged, or a table that is wrong, skip nothing: the frame turns by itself, and the EMF does not turn with
 * it. So while there is more EMF to expect than resistance and dead time may hide, half of it must be where the switches say;
 * otherwise the drive could push at its limit for ever, and a shaft turn the other way.
 */

struct hall_watch {
    uint32_t invalid, skipped;   /* the interrupt's counts at the last step */
    struct rotor_seed sound;     /* the rotor at that step, whatever the switches say */
    uint32_t doubt_ms;           /* how long they have said something else */
    uint32_t doubt_q16;          /* and how far it has turned since, electrical turns */
    int32_t torque_q29;          /* the speed loop's torque memory before that */
    int32_t emf_q4, expected_q4; /* along the frame, filtered; 4 more bits */
    uint32_t wrong_ms;           /* that the former is missing */
};

/* Starts afresh. Slow loop. */
void hall_watch_begin(struct axis *a);

/* One millisecond of operation with Hall switches; may raise a fault. Slow loop. */
void hall_watch_step(struct axis *a);

/* The cause of an over-current now: the switches, if the frame has just jumped. Current loop's interrupt, cold. */
enum fault hall_watch_blame(const struct axis *a, enum fault seen);

/* The speed loop's torque memory from before the switches were in doubt. Slow loop. */
int32_t hall_watch_torque_q29(const struct axis *a);

/* ==== a prescribed field ==== */

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

/* ==== all of them ==== */

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
