/* SPDX-License-Identifier: MIT */
/*
 * Set-points a period apart, with linear interpolation: the cyclic synchronous modes of CiA 402 (IEC 61800-7-201), for
 * position, speed and torque alike. A set-point is reached a period after its turn, when the next is due; if none comes, it
 * holds.
 *
 * Time is counted in conversions, many of which a step of the slow loop has. So the turn of a set-point may be between two
 * steps. In whole milliseconds, each time the drive's clock and the master's drift past each other, a set-point would be left
 * out or the reference would stand still for one.
 */
#ifndef FIRMWARE_CONTROL_CYCLIC_H
#define FIRMWARE_CONTROL_CYCLIC_H

#include <stdint.h>

/* An eighth of how far a set-point is off is followed; less than 8 conversions, 0.4 ms at 20 kHz, not at all. */
#define CYCLIC_FOLLOWS 8

struct cyclic {
    int64_t now;     /* at the last step, or at the newest set-point's turn */
    int64_t target;  /* the newest set-point */
    int64_t way;     /* to it, from what the reference was at its turn */
    int32_t period;  /* conversions for that way, */
    int32_t left;    /* and those to go */
    int32_t ahead;   /* conversions that `now` has gone beyond the last step */
    uint32_t due;    /* the newest set-point's turn: a number of a conversion */
    int64_t stepped; /* at the last step, */
    int64_t moved;   /* and from the step before to it */
};

/* Begins at a value, which is also the target. Slow loop, or while it is masked. */
static inline void cyclic_begin(struct cyclic *c, int64_t now)
{
    *c = (struct cyclic){.now = now, .target = now, .stepped = now};
}

/* On to so many conversions after the last step. One division of 64 bits. */
static inline void cyclic_go(struct cyclic *c, int32_t conversions)
{
    const int32_t more = conversions - c->ahead;
    c->ahead = conversions;
    if (more > 0 && c->left > 0) {
        c->left = c->left > more ? c->left - more : 0;
        c->now = c->left == 0 ? c->target : c->target - c->way * c->left / c->period;
    }
}

/*
 * The turn of a set-point that came at conversion `at`: a period after that of the one before, corrected slowly by when it
 * came, so that jitter of less than a step does not move the reference. If it is off by more than a step, its turn is when it
 * came.
 */
static inline uint32_t cyclic_due(struct cyclic *c, uint32_t at, int32_t period, int32_t step)
{
    const uint32_t due = c->due + (uint32_t)period;
    const int32_t off = (int32_t)(at - due);
    c->due = off > step || off < -step ? at : due + (uint32_t)(off / CYCLIC_FOLLOWS);
    return c->due;
}

/* A set-point whose turn is so many conversions after the last step. Slow loop. */
static inline void cyclic_aim(struct cyclic *c, int64_t target, int32_t period, int32_t came)
{
    cyclic_go(c, came);
    c->target = target;
    c->way = target - c->now;
    c->period = c->left = period;
}

/* One step, so many conversions after the last. Slow loop. */
static inline int64_t cyclic_step(struct cyclic *c, int32_t conversions)
{
    cyclic_go(c, conversions);
    c->ahead = 0;
    c->moved = c->now - c->stepped;
    c->stepped = c->now;
    return c->now;
}

#endif
