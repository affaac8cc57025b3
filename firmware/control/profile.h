/* SPDX-License-Identifier: MIT */
/*
 * A way to a position within limits of speed, acceleration and jerk, to which the target may be given anew at any time, on the
 * way as at rest. Pure integers, exact at the end. Once a millisecond, in the slow loop; and only while there is a profile.
 *
 * A trapezoid of speed goes through a moving average over `window` steps. The mean of speeds within +-v is within +-v, that
 * of accelerations within +-a within +-a, and its change in a step is the difference of two accelerations `window` steps
 * apart over `window`. Where these are never of opposite sign, the jerk is a / window at most. So the trapezoid does not
 * brake before more than `window` steps have passed since it accelerated, and the other way round: it holds its speed.
 *
 * That costs nothing. From a to -a the quickest way within the jerk takes 2 window steps, too, and the whole is the
 * time-optimal way of seven segments, to the step, for each distance in which a is reached: from 2 a window^2 on. Shorter
 * ways take 2 window steps at least, where the optimum goes with the third root of the distance.
 *
 * Positions are in units of 2^-shift counts, speeds in these a step, accelerations in these a step and step. The distance in
 * which the trapezoid stops, v + (v - a) + ... + rest, is a polynomial of k = v / a, which is followed, not divided for; where
 * a step has to be a part of a, one division of 32 bits finds it.
 */
#ifndef FIRMWARE_CONTROL_PROFILE_H
#define FIRMWARE_CONTROL_PROFILE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/tuning.h"

struct profile {
    int64_t target;
    int64_t position; /* after the average: where the shaft should be */
    int32_t speed;    /* and by how much that moved in this step */
    /* before the average */
    int64_t corner; /* the trapezoid's position */
    int32_t corner_speed;
    int32_t steps;    /* k: |corner_speed| = level + less than a */
    int32_t level;    /* k a */
    int32_t since[2]; /* steps since it was accelerated upwards, downwards; window + 1 at most */
    /* the average */
    int32_t sum;                      /* of `past` */
    int32_t carry;                    /* what the division of the sums by `window` has left so far */
    int32_t at;                       /* the oldest of `past` */
    int32_t past[PARAM_JERK_MOST_MS]; /* speeds of the trapezoid */
};

/* Begins at a position and speed, as if it had had that speed for long. Slow loop, or while it is masked: about 400 cycles. */
void profile_begin(struct profile *p, const struct tuning_profile *t, int64_t position, int32_t speed);

/* Another target, from the next step on. Range: any distance below 2^62 units. Slow loop, or while it is masked. */
static inline void profile_aim(struct profile *p, int64_t target)
{
    p->target = target;
}

/* One step. Slow loop, 150 cycles. */
void profile_step(struct profile *p, const struct tuning_profile *t);

/* Whether it stands at its target. Any context. */
static inline bool profile_is_done(const struct profile *p)
{
    return p->position == p->target && p->corner_speed == 0 && p->sum == 0;
}

/* The origin of all positions is moved by so much. Slow loop, or while it is masked. */
static inline void profile_shift(struct profile *p, int64_t by)
{
    p->target += by;
    p->position += by;
    p->corner += by;
}

#endif
