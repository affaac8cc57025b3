/* SPDX-License-Identifier: MIT */
/* The tuning's arithmetic: a product over a divisor, rounded once; limits of 64-bit values; per-unit values. */
#ifndef FIRMWARE_SETTINGS_SCALE_H
#define FIRMWARE_SETTINGS_SCALE_H

#include <stdint.h>

#define TWO_PI_E9 6283185307LL /* 2 pi, 9 decimals */

/*
 * a b / c rounded to nearest, halves upwards; INT64_MAX if larger. The product has 128 bits. Range: a, b >= 0, c > 0. Thread:
 * some thousand cycles.
 */
int64_t scale(int64_t a, int64_t b, int64_t c);

/* x limited to low...high. Any context. */
static inline int32_t scale_clamp(int64_t x, int32_t low, int32_t high)
{
    return x > high ? high : (x < low ? low : (int32_t)x);
}

/*
 * Converts per-unit values from and to thousandths of an ampere or volt, rounded to nearest, for |milli| <= 4 ranges. Thread.
 */
int32_t tuning_q15_from_milli(int32_t milli, int32_t range_milli);
int32_t tuning_milli_from_q15(int32_t q15, int32_t range_milli);

#endif
