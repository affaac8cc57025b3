/* SPDX-License-Identifier: MIT */
/*
 * The 32-bit kernels behind Lib.h: values in, values out. Sums are kept in 64 bits and rounded once. This C is the
 * definition; on the Cortex-M3 the compiler makes SMULL and SMLAL of it, whose time depends on the data: not for
 * the current loop, whose kernels stand in transform_q15.h and agree with these to the bit wherever both are defined.
 */
#ifndef LIB_TRANSFORM_S32_H
#define LIB_TRANSFORM_S32_H

#include "lib/Lib.h"

/* 1/sqrt(3) and sqrt(3)/2 with 31 fraction bits, rounded down; s32_refine() supplies what is missing. */
#define S32_INV_SQRT3_Q31  1239850262
#define S32_HALF_SQRT3_Q31 1859775393

/** Two results of one kernel. */
typedef struct {
    int32_t x;
    int32_t y;
} s32_pair_t;

/** The product as 64 bits of two's complement: sums of it are taken modulo 2^64, where C defines every result. */
static inline uint64_t s32_product(int32_t a, int32_t b)
{
    return (uint64_t)((int64_t)a * b);
}

/*
 * Both constants above are short of the true value by the same 2.04e-10 of it, since sqrt(3)/2 = 1.5 / sqrt(3). Adding
 * 2^-32 = 2.33e-10 of the product leaves an excess of 2.9e-11: 0.06 LSB at the largest result.
 */
static inline int64_t s32_refine(int64_t product)
{
    return product + (product >> 32);
}

/**
 * Take `frac` fraction bits (1...31) off a sum to which the rounding constant has been added, and saturate to 32 bits.
 *
 * The rounded sum or difference of two products fits 64 bits but for one: the sum x c + y s of four times INT32_MIN is
 * 2^63, which wraps to a high word of INT32_MIN. No other such sum comes below -2^63 + 2^32, a high word of INT32_MIN + 1,
 * so that the high word less one has the sign of the true sum wherever saturation asks for it. For such a sum `wrap` is 1.
 * It is 0 for a difference x c - y s, which lies within +-(2^63 - 2^31) and may well have a high word of INT32_MIN.
 */
static inline __attribute__((always_inline)) int32_t s32_saturate(uint64_t sum, unsigned frac, unsigned wrap)
{
#if defined(__ARM_ARCH_7M__) && defined(__OPTIMIZE__) && !defined(LIB_PORTABLE) /* frac, wrap must be seen constant */
    int32_t result;
    int32_t sign;

    __asm__("lsr    %[result], %Q[sum], %[frac]\n\t"
            "asr    %[sign], %R[sum], #31\n\t"
            "orr    %[result], %[result], %R[sum], lsl %[rest]\n\t"
            "cmp    %[sign], %R[sum], asr %[excess]\n\t"
            "itt    ne\n\t"
            "subne  %[sign], %R[sum], %[wrap]\n\t"
            "eorne  %[result], %[limit], %[sign], asr #31"
            : [result] "=&r"(result), [sign] "=&r"(sign)
            : [sum] "r"(sum), [limit] "r"(INT32_MAX), [frac] "i"(frac), [rest] "i"(32U - frac), [excess] "i"(frac - 1U),
              [wrap] "i"(wrap)
            : "cc");
    return result;
#else
    const uint32_t high = (uint32_t)(sum >> 32);
    const int32_t excess = (int32_t)high >> (frac - 1U); /* 0 or -1 if the value fits */
    const int32_t limit = INT32_MAX ^ ((int32_t)(high - wrap) >> 31);

    return excess == (excess >> 31) ? (int32_t)(uint32_t)(sum >> frac) : limit;
#endif
}

/** ibeta of Clarke_Lib_Do. The sum stays below 3 * 2^31 / sqrt(3) * 2^31 = 2^62.8. */
static inline int32_t s32_clarke_beta(int32_t ia, int32_t ib)
{
    const int64_t a = (int64_t)ia * S32_INV_SQRT3_Q31;
    const int64_t b = (int64_t)ib * S32_INV_SQRT3_Q31;

    return s32_saturate((uint64_t)(s32_refine(a + b + b) + (INT64_C(1) << 30)), 31U, 0U);
}

/** vb and vc of InvClarke_Lib_Do. The sums stay below 1.37 * 2^62. */
static inline s32_pair_t s32_invclarke_bc(int32_t valpha, int32_t vbeta)
{
    const int64_t half_alpha = (int64_t)valpha * (INT64_C(1) << 30);
    const int64_t beta = s32_refine((int64_t)vbeta * S32_HALF_SQRT3_Q31);
    const int64_t half_lsb = INT64_C(1) << 30;

    /* One less than half in vc turns its ties down, so that they cancel those of vb. */
    return (s32_pair_t){s32_saturate((uint64_t)(half_lsb - half_alpha + beta), 31U, 0U),
                        s32_saturate((uint64_t)(half_lsb - 1 - half_alpha - beta), 31U, 0U)};
}

/** Park: the vector (x, y) seen from a frame turned by +angle. */
static inline s32_pair_t s32_park(int32_t x, int32_t y, int32_t cosine, int32_t sine)
{
    const uint64_t half_lsb = UINT64_C(1) << (LIB_TRIG_FRAC - 1);
    const uint64_t along = half_lsb + s32_product(x, cosine) + s32_product(y, sine);
    const uint64_t across = half_lsb + s32_product(y, cosine) - s32_product(x, sine);

    return (s32_pair_t){s32_saturate(along, LIB_TRIG_FRAC, 1U), s32_saturate(across, LIB_TRIG_FRAC, 0U)};
}

/** Inverse Park: the vector (x, y) of a frame turned by +angle seen from the stationary one. */
static inline s32_pair_t s32_invpark(int32_t x, int32_t y, int32_t cosine, int32_t sine)
{
    const uint64_t half_lsb = UINT64_C(1) << (LIB_TRIG_FRAC - 1);
    const uint64_t alpha = half_lsb + s32_product(x, cosine) - s32_product(y, sine);
    const uint64_t beta = half_lsb + s32_product(y, cosine) + s32_product(x, sine);

    return (s32_pair_t){s32_saturate(alpha, LIB_TRIG_FRAC, 0U), s32_saturate(beta, LIB_TRIG_FRAC, 1U)};
}

#endif
