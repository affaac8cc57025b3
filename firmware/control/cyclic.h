/* SPDX-License-Identifier: MIT */
/*
 * Set-points a period apart, with linear interpolation: the cyclic synchronous modes of CiA 402 (IEC 61800-7-201), for
 * position, speed and torque alike. A set-point is reached a period after it came, when the next is due; if none comes, it
 * holds.
 *
 * Time is counted in conversions, many of which a step of the slow loop has. So a set-point begins where it came between
 * two steps, and a master whose clock is not the drive's does not tick: with whole milliseconds each beat of the two clocks
 * would leave out a set-point or stand still for one.
 */
#ifndef FIRMWARE_CONTROL_CYCLIC_H
#define FIRMWARE_CONTROL_CYCLIC_H

#include <stdint.h>

#define CYCLIC_FOLLOWS 8 /* set-points, in which half of a step's jitter is followed */

struct cyclic {
    int64_t now;     /* at the last step, or when the newest set-point came */
    int64_t target;  /* the newest set-point */
    int64_t way;     /* to it from where it came */
    int32_t period;  /* conversions for that way, */
    int32_t left;    /* and those to go */
    int32_t ahead;   /* conversions that `now` has gone beyond the last step */
    uint32_t due;    /* conversion at which the newest set-point belongs */
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
 * Where a set-point belongs that came at `at`: a period after the one before, which follows what comes slowly, so that it does
 * not matter how regularly the master sends within a step. One that is off by more than a step begins where it came.
 */
static inline uint32_t cyclic_due(struct cyclic *c, uint32_t at, int32_t period, int32_t step)
{
    const uint32_t due = c->due + (uint32_t)period;
    const int32_t off = (int32_t)(at - due);
    c->due = off > step || off < -step ? at : due + (uint32_t)(off / CYCLIC_FOLLOWS);
    return c->due;
}

/* A set-point that belongs so many conversions after the last step. Slow loop. */
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
