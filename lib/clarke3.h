/* SPDX-License-Identifier: MIT */
/*
 * The other forms of the Clarke transform on Q15 values, for three sensors or another pair of two. As in transform_q15.h:
 * amplitude-invariant, alpha along phase A, 32-bit products only, no branch, no state, any context.
 * Equations: E. Clarke, "Circuit Analysis of A-C Power Systems" (1943); the general form corrects EQ1 and EQ2 of Microsemi's
 * guide.
 */
#ifndef LIB_CLARKE3_H
#define LIB_CLARKE3_H

#include "lib/transform_q15.h"

/**
 * Clarke transform of any three phase quantities: alpha = (2 a - b - c) / 3, beta = (b - c) / sqrt(3). The zero sequence has no
 * effect.
 * Range: |a|, |b|, |c| <= 32768. Result: |alpha| <= 43691, |beta| <= 37838; alpha correctly rounded (swept over all sums a + b
 * + c); beta within 0.523 LSB (swept over all differences b - c). No saturation. In registers 12 cycles (`make bench`, as all
 * of these).
 *
 * 1/3 in Q15 is 10923 - 1/4 - 1/16 - 0.021.
 */
static inline alphabeta_t clarke3_q15(abc_t i)
{
    const int32_t sum = i.a + i.b + i.c;
    const int32_t third_q30 = sum * 10923 - (sum >> 2) - (sum >> 4);

    return (alphabeta_t){i.a - q15_from_q30(third_q30), clarke_beta_q15(i.b - i.c)};
}

/**
 * Clarke transform of balanced quantities with b and c measured: alpha = -b - c, beta = (b - c) / sqrt(3).
 * Range: |b|, |c| <= 32768. Result: alpha exact, up to 65536; beta as in clarke3_q15(). In registers 7 cycles.
 */
static inline alphabeta_t clarke_bc_q15(int32_t b, int32_t c)
{
    return (alphabeta_t){-b - c, clarke_beta_q15(b - c)};
}

/**
 * Clarke transform of balanced quantities with a and c measured: alpha = a, beta = -(a + 2 c) / sqrt(3).
 * Range: |a|, |c| <= 32768. Result: as clarke_q15(). In registers 5 cycles.
 */
static inline alphabeta_t clarke_ca_q15(int32_t c, int32_t a)
{
    return (alphabeta_t){a, clarke_beta_q15(-(a + 2 * c))};
}

#endif
