/* SPDX-License-Identifier: MIT */
/*
 * The position loop: a gain before the speed loop, and what the way itself needs, speed and acceleration, fed forward. Once a
 * millisecond, in the slow loop. One bandwidth sets its stiffness; its margin: settings/margin_position.h.
 *
 * Positions are in units of 2^-shift counts (tuning.h). A reference of X counts stands in the middle of the count X. While the
 * way goes on, the shaft is where the edges and the time since the last one say; where it ends, in the middle of its count: a
 * shaft that stands within the count it should has no error, and nothing hunts for what the encoder does not show.
 */
#ifndef FIRMWARE_CONTROL_POSITION_H
#define FIRMWARE_CONTROL_POSITION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/interval.h"
#include "firmware/control/speed_loop.h"
#include "firmware/control/turns.h"
#include "firmware/settings/tuning.h"

struct position_loop {
    int64_t ref;          /* where the shaft should be now */
    int32_t ref_speed;    /* units a millisecond, in the millisecond that ends now */
    int64_t error;        /* reference less shaft */
    int32_t error_counts; /* the same, whole counts, rounded down */
    uint32_t far_ms;      /* since when it has been beyond the window */
};

/* Where the shaft is. `moving`: as the edges say, else the middle of its count. Any context. */
int64_t position_of_shaft(const struct turns *turns, const struct speed_estimate *e, const struct tuning *t,
                          bool moving);

/* The middle of a count. Any context. */
static inline int64_t position_of_counts(int64_t counts, const struct tuning *t)
{
    return counts * (1LL << t->profile.shift) + (1LL << t->profile.shift >> 1);
}

/* And the count in which a position lies. Any context. */
static inline int64_t position_counts(int64_t position, const struct tuning *t)
{
    return position >> t->profile.shift;
}

/* Begins where the reference is to be, with its speed; nothing is far from it. Slow loop, or while it is masked. */
void position_begin(struct position_loop *p, int64_t ref, int32_t ref_speed);

/*
 * One step: returns the wish for torque (torque.h). `next_ref` is where the shaft should be in a millisecond; the reference of
 * this step is the one before. Slow loop.
 */
int32_t position_step(struct position_loop *p, int64_t next_ref, struct speed_loop *s, const struct turns *turns,
                      const struct tuning *t, const struct interval *limits);

/* Whether the shaft has been too far from the reference for too long. Slow loop, after each step. */
bool position_is_lost(struct position_loop *p, const struct tuning *t);

#endif
