/* SPDX-License-Identifier: MIT */
/*
 * Angle and length of a vector, by tables of chords: no division, no 64-bit product, no loop, no branch on data. No state,
 * any context. A word of the first two tables is V * 4096 + slope, as in trig.h.
 */
#ifndef LIB_POLAR_H
#define LIB_POLAR_H

#include "lib/q15.h"

/** 2^19 / m at m = 1 + i/128, and the chord's fall: in 1/8 of a 17-bit reciprocal, half a unit included. */
extern const uint32_t polar_reciprocals[128];

/** atan(i/128) and the chord's rise, in 1/16 of 1/65536 turn. One more for ratios that round to 1. */
extern const uint32_t polar_arctangents[129];

/** 2 * 32768 * sqrt(i / 64) - 65537 for i = 64...256, rounded up after adding the chord's sag. Index i - 64. */
extern const uint16_t polar_roots[193];

/** 2^16 / m of m = normalized / 2^31, in 1...2, rounded. normalized >= 2^31, or 0, which gives 65536. */
static inline uint32_t polar_reciprocal_q16(uint32_t normalized)
{
    const uint32_t word = polar_reciprocals[(normalized >> 24) & 127U];
    const uint32_t part_q12 = (normalized >> 12) & 0xFFFU;

    return (word - (word & 0xFFFU) * (part_q12 + 1U)) >> 15;
}

/** atan of ratio_q31 in 0...1 as a fraction of a turn. */
static inline uint32_t polar_arctangent_q32(uint32_t ratio_q31)
{
    const uint32_t word = polar_arctangents[ratio_q31 >> 24];
    const uint32_t part_q12 = (ratio_q31 >> 12) & 0xFFFU;

    return word + (word & 0xFFFU) * (part_q12 - 1U);
}

/**
 * Angle of the vector (x, y) as a fraction of a turn, 2^32 = one turn, counted from the x axis towards the y axis.
 * Range: any x and y; (0, 0) gives 0. Exact on the axes. Error at most 0.21 / 65536 turn if |x|, |y| <= 65535, else 0.53: the
 * sum of the errors of the two tables and of 16 bits of the smaller coordinate; tests/lib sweeps each.
 */
static inline uint32_t atan2_q32(int32_t y, int32_t x)
{
    const uint32_t x_size = x < 0 ? 0U - (uint32_t)x : (uint32_t)x;
    const uint32_t y_size = y < 0 ? 0U - (uint32_t)y : (uint32_t)y;
    const uint32_t larger = x_size > y_size ? x_size : y_size;
    const uint32_t smaller = x_size > y_size ? y_size : x_size;
    const int shift = __builtin_clz(larger | 1U);
    const uint32_t ratio_q31 = ((smaller << shift) >> 16) * polar_reciprocal_q16(larger << shift);
    uint32_t angle_q32 = polar_arctangent_q32(ratio_q31);

    angle_q32 = y_size > x_size ? (1U << 30) - angle_q32 : angle_q32;
    angle_q32 = x < 0 ? (1U << 31) - angle_q32 : angle_q32;
    return y < 0 ? 0U - angle_q32 : angle_q32;
}

/**
 * Angle of the vector (x, y), 65536 = one turn, 0...65535.
 * Range: any x and y; (0, 0) gives 0. Exact on the axes. Error at most 0.71 of a unit if |x|, |y| <= 65535, else 1.03. In
 * registers 45 cycles (`make bench`).
 */
static inline uint32_t atan2_q15(int32_t y, int32_t x)
{
    return (atan2_q32(y, x) + 0x8000U) >> 16;
}

/**
 * Twice the root of a square in 2^30...2^32 - 1, too large by 0 to 1.5: a chord above the curve. The chord never falls, so its
 * bounds at two squares hold for all between them.
 */
static inline uint32_t polar_twice_root(uint32_t normalized)
{
    const uint16_t *const chord = &polar_roots[(normalized >> 24) - 64U];
    const uint32_t part_q16 = (normalized >> 8) & 0xFFFFU;

    return 65537U + chord[0] + (((uint32_t)(chord[1] - chord[0]) * part_q16) >> 16);
}

/** Half the shift that brings a square to 2^30 or more; 1 replaces 0, which no shift brings there. */
static inline unsigned polar_half_shift(uint32_t square)
{
    return (unsigned)__builtin_clz(square | 1U) >> 1;
}

static inline uint32_t polar_normalized(uint32_t square, unsigned half_shift)
{
    return ((square | 1U) << half_shift) << half_shift;
}

/**
 * Root of `square`, correctly rounded (there are no ties).
 * Range: any. Result: 0...65536.
 *
 * The chord's result, shifted back, is the root or 1 more; it is more if (result - 1/2)^2 exceeds the square.
 */
static inline int32_t polar_root(uint32_t square)
{
    const unsigned half_shift = polar_half_shift(square);
    const uint32_t twice_root = polar_twice_root(polar_normalized(square, half_shift));
    const uint32_t root = ((twice_root >> half_shift) + 1U) >> 1;

    return (int32_t)root + ((int32_t)(square - root * root + root - 1U) >> 31);
}

/** Root of `square`, rounded down: exact. Range: any. Result: 0...65535. */
static inline int32_t polar_root_down(uint32_t square)
{
    const unsigned half_shift = polar_half_shift(square);
    const uint32_t twice_root = polar_twice_root(polar_normalized(square, half_shift));
    const uint32_t root = twice_root >> (half_shift + 1U);

    return (int32_t)root + ((int32_t)(square - root * root) >> 31);
}

/**
 * Length of the vector (x, y). Range: x^2 + y^2 < 2^32, as all vectors in transform_q15.h. Correctly rounded. In
 * registers 27 cycles (`make bench`).
 */
static inline int32_t magnitude_q15(int32_t x, int32_t y)
{
    return polar_root((uint32_t)x * (uint32_t)x + (uint32_t)y * (uint32_t)y);
}

#endif
