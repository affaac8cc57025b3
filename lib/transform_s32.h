/* SPDX-License-Identifier: MIT */
/*
 * The 32-bit kernels behind Lib.h: values in, values out. This C is the definition; Lib_thumb2.S computes the same bit for bit.
 * It uses 64-bit products, whose time depends on the data on the Cortex-M3: not for the current loop, whose kernels are in
 * transform_q15.h.
 */
#ifndef LIB_TRANSFORM_S32_H
#define LIB_TRANSFORM_S32_H

#include <stdint.h>

/* 2/sqrt(3) - 1 and sqrt(3)/2 - 1 with 32 fraction bits, to nearest: 0.0125 too small, and 0.2407 too large. */
#define S32_CLARKE_Q32    INT64_C(664433753)
#define S32_INVCLARKE_Q32 INT64_C(-575416509)

/** Two results of one kernel. */
typedef struct {
    int32_t x;
    int32_t y;
} s32_pair_t;

static inline int32_t s32_saturate(int64_t value)
{
    const int32_t low = (int32_t)value;

    return low == value ? low : INT32_MAX ^ (int32_t)(value >> 63);
}

/**
 * ibeta of Clarke_Lib_Do. With half = (ia + 2 ib) / 2 rounded down, the exact value is 2/sqrt(3) half, and 1/sqrt(3) more if ia
 * is odd: then rounding up comes within 0.583 LSB of it. If half saturates, so does the result.
 */
static inline int32_t s32_clarke_beta(int32_t ia, int32_t ib)
{
    const int32_t half = s32_saturate((int64_t)ib + (ia >> 1));
    const int64_t product = half * S32_CLARKE_Q32;
    const int64_t up = ((product >> 31) | ia) & 1;

    return s32_saturate(half + (product >> 32) + up);
}

/**
 * vb and vc of InvClarke_Lib_Do: beta - valpha/2 and -beta - valpha/2 with beta = sqrt(3)/2 vbeta. If valpha is odd, the halves
 * are taken as floor and ceiling of valpha/2, and beta is rounded down: this also rounds vb and vc to nearest, and their sum
 * stays -valpha.
 */
static inline s32_pair_t s32_invclarke_bc(int32_t valpha, int32_t vbeta)
{
    const int32_t odd = valpha & 1;
    const int32_t half = valpha >> 1;
    const int64_t product = vbeta * S32_INVCLARKE_Q32;
    const int64_t beta = vbeta + (product >> 32) + ((product >> 31) & 1 & ~odd);

    return (s32_pair_t){s32_saturate(beta - half), s32_saturate(-beta - half - odd)};
}

/**
 * a b + c d. The only sum that does not fit is 2^62 + 2^62: it gives 2^63 - 2^31 instead. Both saturate, however many bits are
 * dropped; no other sum is larger than that, so half an LSB can still be added.
 */
static inline int64_t s32_sum(int32_t a, int32_t b, int32_t c, int32_t d)
{
    const int64_t first = (int64_t)a * b;
    const int64_t second = (int64_t)c * d;
    const int64_t limit = INT64_C(1) << 62;

    return first + (first == limit && second == limit ? limit - (INT64_C(1) << 31) : second);
}

/** Drops `frac` bits (1...31): to nearest, ties up, saturated. */
static inline int32_t s32_round(int64_t sum, unsigned frac)
{
    return s32_saturate((sum + (INT64_C(1) << (frac - 1U))) >> frac);
}

/** Park: the vector (x, y) seen from a frame turned by +angle; cosine and sine have `frac` fraction bits. */
static inline s32_pair_t s32_park(int32_t x, int32_t y, int32_t cosine, int32_t sine, unsigned frac)
{
    return (s32_pair_t){s32_round(s32_sum(x, cosine, y, sine), frac),
                        s32_round((int64_t)y * cosine - (int64_t)x * sine, frac)};
}

/** Inverse Park: the vector (x, y) of a frame turned by +angle seen from the stationary one. */
static inline s32_pair_t s32_invpark(int32_t x, int32_t y, int32_t cosine, int32_t sine, unsigned frac)
{
    return (s32_pair_t){s32_round((int64_t)x * cosine - (int64_t)y * sine, frac),
                        s32_round(s32_sum(y, cosine, x, sine), frac)};
}

#endif
