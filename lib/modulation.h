/* SPDX-License-Identifier: MIT */
/*
 * Space-vector modulation by min-max zero-sequence injection: all three voltages shift by the same amount, which centres the
 * largest and the smallest about 0. This splits the zero time equally: D. G. Holmes, T. A. Lipo, "Pulse Width Modulation for
 * Power Converters", 2003, chapter 6; linear up to a phase amplitude of vbus / sqrt(3), 2/sqrt(3) times that of plain sine
 * modulation.
 */
#ifndef LIB_MODULATION_H
#define LIB_MODULATION_H

#include "lib/q15.h"

/**
 * Half of largest plus smallest of a, b and c, with a + b + c = 0 and minus_c = a + b. It then equals minus half of the middle
 * one, so one maximum and two comparisons find it. Rounded down; up if c is larger than both others.
 * Range: |a|, |b|, |minus_c| < 2^30. Context: any. 10 cycles (9 if a is no longer needed), no branch.
 */
static inline int32_t svm_middle(int32_t a, int32_t b, int32_t minus_c)
{
    const int32_t upper = q15_max(a, b);
    const int32_t minus_lower = upper - minus_c;

#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE) /* 3 cycles less than the compiler's */
    int32_t middle;

    __asm__("asr    %[middle], %[minus_c], #1\n\t"
            "cmp    %[minus_c], %[minus_lower]\n\t"
            "it     gt\n\t"
            "asrgt  %[middle], %[minus_lower], #1\n\t"
            "cmn    %[minus_c], %[upper]\n\t"
            "itt    lt\n\t"
            "asrlt  %[middle], %[upper], #1\n\t"
            "rsblt  %[middle], %[middle], #0"
            : [middle] "=&l"(middle)
            : [minus_c] "l"(minus_c), [minus_lower] "l"(minus_lower), [upper] "l"(upper)
            : "cc");
    return middle;
#else
    int32_t middle = minus_c >> 1;
    if (minus_c > minus_lower) {
        middle = minus_lower >> 1;
    }
    if (minus_c < -upper) {
        middle = -(upper >> 1);
    }
    return middle;
#endif
}

/**
 * The three voltages with their zero sequence: v - (max + min) / 2, for v.a + v.b + v.c = 0 (v.c is not read), in any unit. The
 * results lie within +-sqrt(3)/2 of the amplitude, rounded up to a whole number. Line-to-line voltages are unchanged to the
 * bit. The largest and the smallest result sum to 0, or to 1 if the half was rounded down and -1 if up.
 * Range: |v| < 2^29. Context: any. 15 cycles without loads and stores. Times (on-time / 2 per volt), plus a quarter of the
 * period, it is the high side's edge.
 */
static inline abc_t svm_minmax(abc_t v)
{
    const int32_t minus_c = v.a + v.b;
    const int32_t middle = svm_middle(v.a, v.b, minus_c);

    return (abc_t){v.a - middle, v.b - middle, -minus_c - middle};
}

#endif
