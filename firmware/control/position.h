/* SPDX-License-Identifier: MIT */
/*
 * The shaft's position over many turns, and the position loop.
 *
 * The loop is a gain before the speed loop, plus feed-forward of the profile's speed and acceleration. Once a millisecond, in
 * the slow loop. One bandwidth sets its stiffness; its margin: settings/margins.h.
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
#include "firmware/settings/tuning.h"

/* ---- over many turns ---- */

/*
 * Counts of the encoder since its zero, from a counter that wraps each turn. Tracked with the bridge on or off, so nothing is
 * lost in between. Once a millisecond, in the slow loop.
 */
struct turns {
    int64_t counts; /* since the zero: 292 million years at full speed of the finest encoder */
    uint32_t count; /* of the encoder, at the last step: 0 ... counts of a turn less one */
};

/* Sets position 0 at the encoder's present `count`. Slow loop, or while it is masked. */
static inline void turns_begin(struct turns *t, uint32_t count)
{
    *t = (struct turns){.count = count};
}

/* One step: the shaft moved by `moved` counts (speed_estimate.h), and the encoder shows `count`. Slow loop. */
static inline void turns_follow(struct turns *t, int32_t moved, uint32_t count)
{
    t->count = count;
    t->counts += moved;
}

/* The position nearest to `near` whose lower 32 bits are `counts`: hosts show and send no more of them. Any context. */
static inline int64_t turns_nearest(int64_t near, int32_t counts)
{
    return near + (int32_t)((uint32_t)counts - (uint32_t)near);
}

/* The position with counter value `count` that is less than half a turn from here. Any context. */
int64_t turns_at(const struct turns *t, uint32_t count, int32_t turn);

/* ---- the loop ---- */

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
