/* SPDX-License-Identifier: MIT */
/*
 * Turns a vector by a small angle without a sine, by two shears,
 *     x' = x - t y,  y' = y + t x'        with t = 2 sin(angle / 2)
 * (Minsky's circle algorithm: M. Beeler, R. W. Gosper, R. Schroeppel, HAKMEM, MIT AI memo 239, 1972, items 149 to 152.) The
 * pair has determinant 1, so lengths do not grow from turn to turn; it turns along an ellipse whose axes differ by about t/2. A
 * single turn changes the length by up to about t^2/2, and the direction by as much in radians: 0.6 % and 0.3 degrees at 6
 * degrees, 2 % and 1.2 degrees at 11.5. For such t, t = angle in radians is as good.
 */
#ifndef LIB_ADVANCE_H
#define LIB_ADVANCE_H

#include "lib/q15.h"

/** The largest turn, 0.6: 34 degrees. */
#define ADVANCE_MAX_Q15 19660

/**
 * (x, y) turned from x towards y by t. Range: |x|, |y| <= 65535, |turn_q15| <= ADVANCE_MAX_Q15. x is rounded up, then y,
 * calculated from that x, down. The result's components are at most 1.6 times the larger of the two, plus 1. Context: any. 4
 * cycles.
 */
static inline void advance_q15(int32_t *x, int32_t *y, int32_t turn_q15)
{
    *x -= (turn_q15 * *y) >> 15;
    *y += (turn_q15 * *x) >> 15;
}

#endif
