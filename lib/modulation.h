/* SPDX-License-Identifier: MIT */
/*
 * From phase voltages to on-time fractions of the high sides, by min-max zero-sequence injection. This is space-vector
 * modulation with the zero time shared equally: D. G. Holmes, T. A. Lipo, "Pulse Width Modulation for Power Converters",
 * 2003, chapter 6; linear up to a phase amplitude of vbus / sqrt(3), 2/sqrt(3) times that of plain sine modulation.
 */
#ifndef LIB_MODULATION_H
#define LIB_MODULATION_H

#include "lib/q15.h"

/** 1.0 in the Q14 of a reciprocal, and the largest one that can be tracked: a bus of 0.125. */
#define RECIP_ONE_Q14 16384
#define RECIP_MAX_Q14 131072

/**
 * On-time fractions, Q15, saturated to 0...32767: duty = 1/2 + (v - (max + min)/2) / vbus.
 * vbus_recip_q14: 1 / vbus, Q14, 16384 (vbus = 1.0) ... 131072 (vbus = 0.125). Range: max - min < 2.99 vbus, which is
 * three times what the bridge can make. Each duty is rounded once, to nearest; the common part is kept to half an LSB,
 * so that line-to-line voltages come out within 1 LSB of duty.
 */
static inline abc_t svm_minmax_q15(abc_t v_q15, int32_t vbus_recip_q14)
{
    const int32_t middle_q16 =
        q15_max(q15_max(v_q15.a, v_q15.b), v_q15.c) + q15_min(q15_min(v_q15.a, v_q15.b), v_q15.c);
    const int32_t half_and_rounding_q30 = (1 << 29) + (1 << 14);

    return (abc_t){q15_unsigned_from_q30((2 * v_q15.a - middle_q16) * vbus_recip_q14 + half_and_rounding_q30),
                   q15_unsigned_from_q30((2 * v_q15.b - middle_q16) * vbus_recip_q14 + half_and_rounding_q30),
                   q15_unsigned_from_q30((2 * v_q15.c - middle_q16) * vbus_recip_q14 + half_and_rounding_q30)};
}

/**
 * One Newton step towards 1 / vbus: recip + recip (1 - recip vbus). It squares the relative error; called once a sample
 * it follows the bus without a division, and settles within 1 LSB or 2^-16 of the exact value, whichever is more (it may
 * alternate between two neighbours).
 * Range: 0 <= vbus_q15 <= 32767, 4 <= recip_q14 <= 131072. A step changes the value by at most an eighth, so that it
 * finds its way from anywhere; the result stays in the range: below a bus of 0.125 duties are too small, never too large.
 */
static inline int32_t recip_q14_refine(int32_t recip_q14, int32_t vbus_q15)
{
    const uint32_t product_q29 = (uint32_t)recip_q14 * (uint32_t)vbus_q15; /* below 2^32 */
    const int32_t bounded_q29 = (int32_t)(product_q29 < 1U << 30 ? product_q29 : 1U << 30);
    const int32_t error_q16 = q15_clamp(((1 << 29) - bounded_q29 + (1 << 12)) >> 13, -8192, 8192);

    return q15_min(recip_q14 + ((recip_q14 * error_q16 + (1 << 15)) >> 16), RECIP_MAX_Q14);
}

#endif
