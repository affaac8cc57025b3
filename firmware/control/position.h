/* SPDX-License-Identifier: MIT */
/*
 * The position loop: a gain before the speed loop, plus feed-forward of the profile's speed and acceleration. Once a
 * millisecond, in the slow loop. One bandwidth sets its stiffness; its margin: settings/margins.h.
 *
 * Positions are in units of 2^-shift counts (tuning.h). A reference of X counts means the middle of count X. During a move, the
 * shaft's position comes from the edges and the time since the last one; at its end, it is the middle of the count: a shaft
 * within its target count has no error, and the loop does not hunt for what the encoder cannot resolve. An error beyond
 * following_mturn is answered like that: a shaft that was held comes back no faster.
 */
#ifndef FIRMWARE_CONTROL_POSITION_H
#define FIRMWARE_CONTROL_POSITION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/interval.h"
#include "firmware/control/speed_loop.h"
#include "firmware/control/turns.h"
#include "firmware/settings/tuning.h"

#define POSITION_SPEED_MOST 8000000

struct position_loop {
    int64_t ref;          /* where the shaft should be now */
    int32_t ref_speed;    /* units a millisecond, in the millisecond ending now */
    int64_t error;        /* reference less shaft */
    int32_t error_counts; /* the same, whole counts, rounded down */
    uint32_t far_ms;      /* how long it has been outside the window */
};

/* The shaft's position. `moving`: from the edges, else the middle of its count. Any context. */
int64_t position_of_shaft(const struct turns *turns, const struct speed_estimate *e, const struct tuning *t,
                          bool moving);

/* The middle of a count. Any context. */
static inline int64_t position_of_counts(int64_t counts, const struct tuning *t)
{
    return counts * (1LL << t->profile.shift) + (1LL << t->profile.shift >> 1);
}

/* The count that contains a position. Any context. */
static inline int64_t position_counts(int64_t position, const struct tuning *t)
{
    return position >> t->profile.shift;
}

/* Units a millisecond, at most twice speed_max: the profile's sums have 31 bits. Any context. */
static inline int32_t position_speed(int64_t units)
{
    return scale_clamp(units, -POSITION_SPEED_MOST, POSITION_SPEED_MOST);
}

/* Begins at a reference and its speed, with no following error counted. Slow loop, or while it is masked. */
void position_begin(struct position_loop *p, int64_t ref, int32_t ref_speed);

/*
 * One step: returns the torque demand (torque.h). `next_ref` is where the shaft should be in a millisecond; this step uses the
 * previous one. Slow loop.
 */
int32_t position_step(struct position_loop *p, int64_t next_ref, struct speed_loop *s, const struct turns *turns,
                      const struct tuning *t, const struct interval *limits);

/* Whether the shaft has been too far from the reference for too long. Slow loop, after each step. */
bool position_is_lost(struct position_loop *p, const struct tuning *t);

#endif
