/* SPDX-License-Identifier: MIT */
/*
 * Types and elementary operations of the hot path: per-unit Q15 values in 32-bit registers, 1.0 = 32768.
 *
 * Currents are fractions of the current sensor's range, voltages of the bus-voltage sensor's range. The 32-bit register leaves
 * room above 1.0: a vector of two saturated phase currents is up to 2.0 long. Each function states the range within which it
 * cannot overflow. None branches on data. Context: any.
 */
#ifndef LIB_Q15_H
#define LIB_Q15_H

#include <stdint.h>

#define Q15_ONE  32768
#define Q15_HALF 16384

/** Three phase quantities. */
typedef struct {
    int32_t a;
    int32_t b;
    int32_t c;
} abc_t;

/** A vector in the stationary frame, alpha along phase A, amplitude-invariant. */
typedef struct {
    int32_t alpha;
    int32_t beta;
} alphabeta_t;

/** A vector in the rotor frame, d along the magnet's flux. */
typedef struct {
    int32_t d;
    int32_t q;
} dq_t;

/** Cosine and sine of an angle, Q15: exactly +-32768 at +-1.0. */
typedef struct {
    int32_t cos;
    int32_t sin;
} cossin_t;

/** The larger of two values. */
static inline int32_t q15_max(int32_t x, int32_t y)
{
    return x > y ? x : y;
}

/** The smaller of two values. */
static inline int32_t q15_min(int32_t x, int32_t y)
{
    return x < y ? x : y;
}

/** x limited to low...high; low <= high. */
static inline int32_t q15_clamp(int32_t x, int32_t low, int32_t high)
{
    return q15_min(q15_max(x, low), high);
}

/** |x| for x > INT32_MIN. */
static inline int32_t q15_abs(int32_t x)
{
    return x < 0 ? -x : x;
}

/** x saturated to -32768...32767. Any x. */
static inline int32_t q15_sat16(int32_t x)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE)
    int32_t result;

    __asm__("ssat %0, #16, %1" : "=r"(result) : "r"(x));
    return result;
#else
    return q15_clamp(x, -32768, 32767);
#endif
}

/** A Q30 value rounded to Q15, ties up; value_q30 <= INT32_MAX - 16384. */
static inline int32_t q15_from_q30(int32_t value_q30)
{
    return (value_q30 + Q15_HALF) >> 15;
}

#endif
