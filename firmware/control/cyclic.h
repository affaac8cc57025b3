/* SPDX-License-Identifier: MIT */
/*
 * Set-points `period` milliseconds apart, with linear interpolation: the cyclic synchronous modes of CiA 402 (IEC 61800-7-201),
 * for position, speed and torque alike. A set-point is reached when the next is due; if none comes, it holds.
 */
#ifndef FIRMWARE_CONTROL_CYCLIC_H
#define FIRMWARE_CONTROL_CYCLIC_H

#include <stdint.h>

struct cyclic {
    int64_t now;
    int64_t target;
    int64_t step;
    int32_t left; /* milliseconds until the target is reached */
};

/* Begins at a value, which is also the target. Slow loop, or while it is masked. */
static inline void cyclic_begin(struct cyclic *c, int64_t now)
{
    *c = (struct cyclic){.now = now, .target = now};
}

/* The next set-point. Thread, slow loop masked: one division of 64 bits. */
static inline void cyclic_aim(struct cyclic *c, int64_t target, int32_t period_ms)
{
    c->target = target;
    c->step = (target - c->now) / period_ms;
    c->left = period_ms;
}

/* One step. Slow loop. */
static inline int64_t cyclic_step(struct cyclic *c)
{
    if (c->left > 0) {
        c->left--;
        c->now = c->left == 0 ? c->target : c->now + c->step;
    }
    return c->now;
}

#endif
