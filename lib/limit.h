/* SPDX-License-Identifier: MIT */
/* The voltage circle: what d leaves for q. */
#ifndef LIB_LIMIT_H
#define LIB_LIMIT_H

#include "lib/polar.h"
#include "lib/q15.h"

/**
 * The largest |q| inside the circle for this d: floor(sqrt(radius^2 - d^2)), exact; 0 if |d| >= radius.
 * Range: 0 <= radius_q15 <= 65535, |d_q15| <= 65535. Use it as the q controller's limit, so its anti-windup knows the circle.
 * Context: any. The same instructions for all data.
 */
static inline int32_t circle_rest_q15(int32_t d_q15, int32_t radius_q15)
{
    const uint32_t d = (uint32_t)q15_clamp(d_q15, -radius_q15, radius_q15);
    const uint32_t radius = (uint32_t)radius_q15;

    return polar_root_down(radius * radius - d * d);
}

#endif
