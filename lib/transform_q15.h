/* SPDX-License-Identifier: MIT */
/*
 * The four transforms of the hot path on Q15 values: 32-bit products only, no branch, the same instructions for all data.
 * Equations as in Lib.h (Microsemi's guide, EQ3 to EQ11). Results are rounded once, to nearest, ties up, and equal those
 * of Lib.h with LIB_TRIG_FRAC 15 to the bit.
 *
 * Why nothing overflows: phase currents saturated to +-32767 make a Clarke vector of length <= 65534. Park turns it:
 * |alpha cos + beta sin| <= 65534 * |(cos, sin)|, and cossin_q15() keeps that product, the errors of table and rounding
 * included, below 2^31 - 16384. tests/lib proves this figure over all currents and all angles. Saturation is not needed.
 */
#ifndef LIB_TRANSFORM_Q15_H
#define LIB_TRANSFORM_Q15_H

#include "lib/q15.h"

/**
 * Clarke transform of two phase currents: alpha = a, beta = (a + 2 b) / sqrt(3).
 * Range: |a|, |b| <= 32768. Result: |beta| <= 56756, the exact value correctly rounded (swept over all sums a + 2 b).
 *
 * 1/sqrt(3) does not fit one constant: 98304 times 15 bits fill the word. It is 18918 + (20107 + 1/8) / 32768 in Q15;
 * the second term is the shortest with which every sum rounds to the right side.
 */
static inline alphabeta_t clarke_q15(int32_t a, int32_t b)
{
    const int32_t sum = a + 2 * b;
    const int32_t fine_q30 = sum * 20107 + (sum >> 3);

    return (alphabeta_t){a, q15_from_q30(sum * 18918 + (fine_q30 >> 15))};
}

/**
 * Park transform: d = alpha cos + beta sin, q = beta cos - alpha sin.
 * Range: what clarke_q15() makes of |a|, |b| <= 32767, with cossin_q15()'s values; in general
 * |(alpha, beta)| * |(cos, sin)| < 2^31 - 16384. Result: correctly rounded.
 */
static inline dq_t park_q15(alphabeta_t i, cossin_t angle)
{
    return (dq_t){q15_from_q30(i.alpha * angle.cos + i.beta * angle.sin),
                  q15_from_q30(i.beta * angle.cos - i.alpha * angle.sin)};
}

/**
 * Inverse Park transform: alpha = d cos - q sin, beta = q cos + d sin.
 * Range: |(d, q)| * |(cos, sin)| < 2^31 - 16384, for example |(d, q)| <= 65533. Result: correctly rounded.
 */
static inline alphabeta_t invpark_q15(dq_t v, cossin_t angle)
{
    return (alphabeta_t){q15_from_q30(v.d * angle.cos - v.q * angle.sin),
                         q15_from_q30(v.q * angle.cos + v.d * angle.sin)};
}

/**
 * Inverse Clarke transform: a = alpha, b = (-alpha + sqrt(3) beta) / 2, c = (-alpha - sqrt(3) beta) / 2.
 * Range: |(alpha, beta)| <= 65534, |beta| <= 65534. Result: b and c correctly rounded; a tie (beta = 0, alpha odd) goes
 * up in b and down in c, so that a + b + c = 0 always.
 *
 * sqrt(3)/2 is 28378 - 20859 / 2^18 in Q15.
 */
static inline abc_t invclarke_q15(alphabeta_t v)
{
    const int32_t beta_q30 = v.beta * 28378 + ((v.beta * -20859) >> 18);
    const int32_t b = q15_from_q30(beta_q30 - v.alpha * Q15_HALF);

    return (abc_t){v.alpha, b, -(v.alpha + b)};
}

#endif
