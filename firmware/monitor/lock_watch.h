/* SPDX-License-Identifier: MIT */
/*
 * Without an encoder: detects loss of the rotor's angle, with criteria for each of Hall switches, prescribed field, injection
 * and observer.
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
 * A breaking wire adds or hides an edge up to half an electrical turn before it is detected. For a failover (drive/failover.h)
 * the rotor is tracked meanwhile: once the angle deviates by more than 15 degrees from what the earlier speed predicts, that
 * speed is extrapolated for an electrical turn. After that the switches are trusted again.
 *
 * Exchanged wires or a wrong table skip no sector, but the EMF does not turn with the frame. So while the expected EMF exceeds
 * the uncertainty of resistance and dead time, half of it must be along the frame's q axis; otherwise the drive could run at
 * its current limit, even in the wrong direction.
 */

struct hall_watch {
    uint32_t invalid, skipped;   /* the interrupt's counts at the last step */
    struct rotor_seed sound;     /* the rotor at that step, by the earlier speed while they are suspect */
    uint32_t suspect_ms;         /* how long the switches have deviated */
    uint32_t suspect_turns_q16;  /* and travel since then, electrical turns */
    int32_t torque_q29;          /* the speed loop's integral before that */
    int32_t emf_q4, expected_q4; /* along the frame, filtered; 4 more bits */
    uint32_t wrong_ms;           /* how long the former has been too small */
};

/* Starts over. Slow loop. */
void hall_watch_begin(struct axis *a);

/* The cause of an over-current: the switches, if the frame has just jumped, else `seen`. Current loop's interrupt, cold. */
enum fault hall_watch_blame(const struct axis *a, enum fault seen);

/* The speed loop's integral from before the switches became suspect. Slow loop. */
int32_t hall_watch_torque_q29(const struct axis *a);

/* ==== a prescribed field ==== */

/*
 * Detects, from the EMF alone, whether the rotor still follows a prescribed field. With the rotor behind the field by lambda,
 * in the field's frame and for either direction of rotation:
 *
 *     e = v - R i - j w Lq i = |w| psi (sin lambda, cos lambda)        (axes d and q; q counted along w)
 *
 * A rotor that has pulled out turns at another speed than the field, or not at all: its EMF rotates in this frame, or vanishes.
 * Each millisecond adds points for that or subtracts one; sixty milliseconds without EMF are a fault, or somewhat more of a
 * rotating EMF. Errors of resistance and dead time act along the current and do not affect the q component: it must be a
 * quarter of the whole; or, if the load angle is too large for that, d must exceed the uncertainty. A rotor that a load drives
 * much faster than the field has more EMF than both. Active flux: control/observer.h.
 */
struct field_watch {
    int32_t d_q4, q_q4;  /* e, filtered; 4 more bits */
    int32_t expected_q4; /* |w| psi, with the same filter */
    int32_t out;         /* points: each millisecond adds or subtracts */
};

#define FIELD_WATCH_POINTS 120 /* threshold of the fault */

/* True if the rotor may be out of step already, which then explains other anomalies. Slow loop. */
static inline bool field_watch_suspects(const struct field_watch *w)
{
    return w->out > FIELD_WATCH_POINTS / 4;
}

/* One step in I-f control; may report a fault. Slow loop, each millisecond of operation. */
void field_watch_step(struct axis *a);

/* Resets the points: the observer gives the angle, or nothing turns yet. Slow loop. */
void field_watch_reset(struct field_watch *w);

/* ==== all of them ==== */

struct lock_watch {
    uint32_t source;  /* enum loop_source to which `lost_ms` refers */
    uint32_t lost_ms; /* how long it has been implausible */
};

/* Starts over. Slow loop, when operation begins. */
void lock_watch_begin(struct lock_watch *w);

/*
 * True if observer or injection is implausible now: the angle may be wrong, which explains other anomalies; the fault "lock
 * lost" may follow. Slow loop.
 */
bool lock_watch_suspects(const struct axis *a);

/* One millisecond of operation without an encoder; returns false if it has just reported a lost rotor. Slow loop. */
bool lock_watch_step(struct axis *a);

#endif
