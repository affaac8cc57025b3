/* SPDX-License-Identifier: MIT */
/* The tuning's arithmetic: a product over a divisor, rounded once. */
#ifndef FIRMWARE_SETTINGS_SCALE_H
#define FIRMWARE_SETTINGS_SCALE_H

#include <stdint.h>

#define TWO_PI_E9 6283185307LL /* 2 pi, 9 decimals */

/*
 * a b / c rounded to nearest, halves upwards; INT64_MAX if larger. The product has 128 bits. Range: a, b >= 0, c > 0. Thread:
 * some thousand cycles.
 */
int64_t scale(int64_t a, int64_t b, int64_t c);

#endif
