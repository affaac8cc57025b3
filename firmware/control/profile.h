/* SPDX-License-Identifier: MIT */
/*
 * A move to a position within limits of speed, acceleration and jerk; the target may change at any time, moving or at rest.
 * Pure integers, exact at the end. Once a millisecond, in the slow loop, only while there is a profile.
 *
 * A speed trapezoid passes through a moving average over `window` steps. The mean of speeds within +-v stays within +-v, that
 * of accelerations within +-a stays within +-a, and its change in a step is the difference of two accelerations `window` steps
 * apart, divided by `window`. If these never have opposite signs, the jerk is a / window at most. So the trapezoid holds its
 * speed for more than `window` steps between accelerating and braking, either way.
 *
 * That costs nothing. Within the jerk limit, going from a to -a takes 2 window steps anyway, and the whole is the time-optimal
 * seven-segment profile, to the step, for each distance that reaches a: from 2 a window^2 on. Shorter moves take at least 2
 * window steps, while the optimum grows with the cube root of the distance.
 *
 * Positions are in units of 2^-shift counts, speeds in units per step, accelerations in units per step squared. The trapezoid's
 * stopping distance, v + (v - a) + ... + rest, is a polynomial of k = v / a, which is tracked without division; a step that is
 * only part of a takes one 32-bit division.
 */
#ifndef FIRMWARE_CONTROL_PROFILE_H
#define FIRMWARE_CONTROL_PROFILE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/tuning.h"

/* A target's distance at most; at the largest speed that is nine years. */
#define PROFILE_FARTHEST (1LL << 60)

struct profile {
    int64_t target;
    int64_t position; /* after the average: where the shaft should be */
    int32_t speed;    /* and its change in this step */
    /* before the average */
    int64_t corner; /* the trapezoid's position */
    int32_t corner_speed;
    int32_t steps;    /* k: |corner_speed| = level + less than a */
    int32_t level;    /* k a */
    int32_t since[2]; /* steps since it was accelerated upwards, downwards; window + 1 at most */
    /* the average */
    int32_t sum;                      /* of `past` */
    int32_t carry;                    /* accumulated remainder of dividing the sums by `window` */
    int32_t at;                       /* the oldest of `past` */
    int32_t past[PARAM_JERK_MOST_MS]; /* speeds of the trapezoid */
};

/* Begins at a position and speed, as if it had long had that speed. Slow loop, or while it is masked: about 400 cycles. */
void profile_begin(struct profile *p, const struct tuning_profile *t, int64_t position, int32_t speed);

/* Sets the target from the next step on. Range: PROFILE_FARTHEST from `position`. Slow loop, or while it is masked. */
static inline void profile_aim(struct profile *p, int64_t target)
{
    p->target = target;
}

/* One step. Slow loop, 150 cycles. */
void profile_step(struct profile *p, const struct tuning_profile *t);

/* Whether it is at rest at its target. Any context. */
static inline bool profile_is_done(const struct profile *p)
{
    return p->position == p->target && p->corner_speed == 0 && p->sum == 0;
}

/* Shifts the origin of all positions. Slow loop, or while it is masked. */
static inline void profile_shift(struct profile *p, int64_t by)
{
    p->target += by;
    p->position += by;
    p->corner += by;
}

#endif
