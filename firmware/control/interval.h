/* SPDX-License-Identifier: MIT */
/*
 * Torque limits as intervals that always contain 0. So does their intersection: clamping to it may reduce a torque but never
 * reverses it.
 */
#ifndef FIRMWARE_CONTROL_INTERVAL_H
#define FIRMWARE_CONTROL_INTERVAL_H

#include <stdint.h>

#include "lib/q15.h"

struct interval {
    int32_t low;  /* <= 0 */
    int32_t high; /* >= 0 */
};

/* From -size to size; only 0 for a negative size. */
static inline struct interval interval_both_ways(int32_t size)
{
    const int32_t high = q15_max(size, 0);
    return (struct interval){-high, high};
}

/* `size` at most in the direction of `sign`, and `free` at most in the other. */
static inline struct interval interval_one_way(int32_t sign, int32_t size, int32_t free)
{
    const int32_t limited = q15_max(size, 0);
    return sign < 0 ? (struct interval){-limited, free} : (struct interval){-free, limited};
}

static inline struct interval interval_meet(struct interval a, struct interval b)
{
    return (struct interval){q15_max(a.low, b.low), q15_min(a.high, b.high)};
}

static inline int32_t interval_clamp(struct interval a, int32_t x)
{
    return q15_clamp(x, a.low, a.high);
}

#endif
