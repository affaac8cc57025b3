/* SPDX-License-Identifier: MIT */
/* The voltage circle: what it leaves for q beside d, and the square root it needs. */
#ifndef LIB_LIMIT_H
#define LIB_LIMIT_H

#include "lib/q15.h"

/** 2 * 32768 * (sqrt(i / 64) - 1) for i = 64...256, rounded down; the last entry one less, to fit. Index i - 64. */
extern const uint16_t limit_root_table[193];

/** Leading zeros of x, 32 for 0. */
static inline uint32_t limit_leading_zeros(uint32_t x)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE)
    uint32_t result;

    __asm__("clz %0, %1" : "=r"(result) : "r"(x));
    return result;
#else
    return x == 0U ? 32U : (uint32_t)__builtin_clz(x);
#endif
}

/**
 * floor(sqrt(square)), exact for every 32-bit value. Context: any; constant time, no division, no branch.
 *
 * The argument is shifted left by an even number of bits to 2^30...2^32, where the root has 16 bits. There the table and
 * a chord give it from below by less than one; shifted back, one comparison decides between two neighbours.
 */
static inline uint32_t limit_root(uint32_t square)
{
    const uint32_t half_shift = limit_leading_zeros(square) >> 1;
    const uint32_t shifted = (square << half_shift) << half_shift;
    const uint32_t normal = shifted > 1U << 30 ? shifted : 1U << 30; /* 0 is not to leave the table */
    const uint16_t *const chord = &limit_root_table[(normal >> 24) - 64U];
    const uint32_t part_q16 = (normal >> 8) & 0xFFFFU;
    const uint32_t twice_root = 65536U + chord[0] + (((uint32_t)(chord[1] - chord[0]) * part_q16) >> 16);
    const uint32_t root = twice_root >> (half_shift + 1U);

    return square - root * root > 2U * root ? root + 1U : root;
}

/**
 * The largest |q| inside the circle beside d: floor(sqrt(radius^2 - d^2)); 0 where |d| >= radius.
 * Range: 0 <= radius_q15 <= 65535, |d_q15| <= 65535. It is the limit to give to the q controller, so that its
 * anti-windup knows the circle.
 */
static inline int32_t circle_rest_q15(int32_t d_q15, int32_t radius_q15)
{
    const uint32_t d = (uint32_t)q15_clamp(d_q15, -radius_q15, radius_q15);
    const uint32_t radius = (uint32_t)radius_q15;

    return (int32_t)limit_root(radius * radius - d * d);
}

#endif
