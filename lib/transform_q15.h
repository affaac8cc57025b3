/* SPDX-License-Identifier: MIT */
/*
 * The four transforms of the hot path on Q15 values: 32-bit products only, no branch, the same instructions for all data.
 * Equations as in Lib.h (Microsemi's guide, EQ3 to EQ11). Park and its inverse are correctly rounded, and equal those of
 * Lib.h with LIB_TRIG_FRAC 15 to the bit. Clarke and its inverse spend no instruction on the last 0.04 LSB. No state:
 * re-entrant, any context.
 *
 * Why nothing overflows: phase currents saturated to +-32767 make a Clarke vector of length <= 65534. Park turns it:
 * |alpha cos + beta sin| <= 65534 * |(cos, sin)|, and cossin_q15() keeps that product, the errors of table and rounding
 * included, below 2^31 - 16384. tests/lib proves this figure over all currents and all angles. Saturation is not needed.
 */
#ifndef LIB_TRANSFORM_Q15_H
#define LIB_TRANSFORM_Q15_H

#include "lib/factors.h"
#include "lib/q15.h"

/**
 * sum / sqrt(3), the beta of every Clarke transform. Range: |sum| <= 98304. Result within 0.534 LSB (swept over all sums).
 *
 * 2/sqrt(3) is 1 + CLARKE_FACTOR_Q17 / 2^17 + 7e-7; half of it, rounded: two roundings down nest, so only 7e-7 is lost.
 */
static inline int32_t clarke_beta_q15(int32_t sum)
{
    return (sum + ((sum * CLARKE_FACTOR_Q17) >> CLARKE_SHIFT) + 1) >> 1;
}

/**
 * Clarke transform of two phase currents: alpha = a, beta = (a + 2 b) / sqrt(3).
 * Range: |a|, |b| <= 32768. Result: alpha exact; |beta| <= 56756, within 0.534 LSB, ties only at 0.
 * In registers 5 cycles.
 */
static inline alphabeta_t clarke_q15(int32_t a, int32_t b)
{
    return (alphabeta_t){a, clarke_beta_q15(a + 2 * b)};
}

/**
 * Park transform: d = alpha cos + beta sin, q = beta cos - alpha sin.
 * Range: clarke_q15()'s results for |a|, |b| <= 32767, with cossin_q15()'s values; in general |(alpha, beta)| * |(cos, sin)| <
 * 2^31 - 16384. Result: correctly rounded, ties up. In registers 10 cycles.
 */
static inline dq_t park_q15(alphabeta_t i, cossin_t angle)
{
    return (dq_t){q15_from_q30(i.alpha * angle.cos + i.beta * angle.sin),
                  q15_from_q30(i.beta * angle.cos - i.alpha * angle.sin)};
}

/**
 * Inverse Park transform: alpha = d cos - q sin, beta = q cos + d sin.
 * Range: |(d, q)| * |(cos, sin)| < 2^31 - 16384, for example |(d, q)| <= 65533. Result: correctly rounded,
 * ties up. In registers 10 cycles.
 */
static inline alphabeta_t invpark_q15(dq_t v, cossin_t angle)
{
    return (alphabeta_t){q15_from_q30(v.d * angle.cos - v.q * angle.sin),
                         q15_from_q30(v.q * angle.cos + v.d * angle.sin)};
}

/**
 * Inverse Clarke transform: a = alpha, b = (-alpha + sqrt(3) beta) / 2, c = (-alpha - sqrt(3) beta) / 2.
 * Range: |(alpha, beta)| <= 65534. Result: a exact, b and c within 0.534 LSB (swept over all beta); a tie (beta = 0, alpha
 * odd) goes up in b and down in c; a + b + c = 0 always. In registers 7 cycles.
 *
 * sqrt(3)/2 in Q15 is SIN60_Q15 - 1/16 - 0.017.
 */
static inline abc_t invclarke_q15(alphabeta_t v)
{
    const int32_t beta_q30 = v.beta * SIN60_Q15 - (v.beta >> 4);
    const int32_t b = q15_from_q30(beta_q30 - v.alpha * Q15_HALF);

    return (abc_t){v.alpha, b, -(v.alpha + b)};
}

#endif
