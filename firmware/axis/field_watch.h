/* SPDX-License-Identifier: MIT */
/*
 * Whether the rotor still hangs on a prescribed field, which nothing but its EMF tells. With the rotor behind the field by
 * lambda, in the field's frame and for either sense of turning:
 *
 *     e = v - R i - j w Lq i = |w| psi (sin lambda, cos lambda)        (axes d and q; q counted along w)
 *
 * A rotor that has pulled out turns otherwise than the field, or not at all: its EMF goes round in this frame, or is none. Each
 * millisecond gives points for that or takes one away; sixty milliseconds of none are enough, and somewhat more of an EMF that
 * goes round. The component in q knows nothing of resistance and dead time, which lie along the current:
 * it has to be there, a quarter of the whole, or if the load angle is too large for that, the one in d beyond what may be
 * hidden.
 * A rotor that a load turns much faster than the field has more EMF than both say. Active flux: control/observer.h.
 */
#ifndef FIRMWARE_AXIS_FIELD_WATCH_H
#define FIRMWARE_AXIS_FIELD_WATCH_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

struct field_watch {
    int32_t d_q4, q_q4;  /* e, filtered; 4 more bits */
    int32_t expected_q4; /* |w| psi, filtered alike */
    int32_t out;         /* points: each millisecond says yes or no */
};

#define FIELD_WATCH_POINTS 120 /* so many are a fault */

/* Whether the rotor may be out of step already: what else is odd then is no cause. Slow loop. */
static inline bool field_watch_doubts(const struct field_watch *w)
{
    return w->out > FIELD_WATCH_POINTS / 4;
}

/* A step while the field leads; may report a fault. Slow loop, each millisecond of operation. */
void field_watch_step(struct axis *a);

/* The observer leads, or nothing turns yet: what was seen is forgotten. Slow loop. */
void field_watch_reset(struct field_watch *w);

#endif
