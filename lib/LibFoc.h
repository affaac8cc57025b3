/* SPDX-License-Identifier: MIT */
/*
 * The rest of the family around Lib.h, in its style: the general Clarke transform and its other two-sensor forms, sine and
 * cosine from an angle, angle and length of a vector, a PI controller, and space-vector modulation. C and C++.
 *
 * Lib.h's rules for all its functions hold here too, except the PI controller's rounding: the whole int32_t range, rounding to
 * nearest with ties up, saturation to INT32_MIN / INT32_MAX and no wrapping, input and output may overlap, re-entrant, no state
 * of their own, no branch on data, any context. Pointers must not be null. Cycles, worst data, call and return included (`make
 * bench`): Clarke3 109, ClarkeBC 60, ClarkeCA 53, SinCos 42, Polar 940, PI 83, SVM 44.
 */
#ifndef LIB_FOC_H
#define LIB_FOC_H

#include <stdint.h>

#include "Lib.h"

#if defined(__PRAGMA_REDEFINE_EXTNAME) && defined(__ELF__) && !defined(LIB_DEFINES)
#pragma redefine_extname SinCos_Lib_Do LIB_CALLED(SinCos_Lib_Do, LIB_TRIG_FRAC) /* Lib.h says why */
#endif

#ifdef __cplusplus
extern "C" {
#endif

/** Cosine and sine with LIB_TRIG_FRAC fraction bits, as Park_Lib_Do and InvPark_Lib_Do take them. */
typedef struct {
    int32_t cos;
    int32_t sin;
} sincosoutput_type;

/** A vector by its coordinates. */
typedef struct {
    int32_t x;
    int32_t y;
} polarinput_type;

/** The same by its length and its angle from the x axis towards the y axis, 2^32 = one turn. */
typedef struct {
    int32_t magnitude;
    uint32_t angle_q32;
} polaroutput_type;

/** One sample for a PI controller, both in the same unit, and the largest output. */
typedef struct {
    int32_t reference;
    int32_t measured;
    int32_t limit;
} piinput_type;

/**
 * Gains and state of one controller, owned by the caller. Set the gains, and the integral to 0; only the integral is written.
 */
typedef struct {
    int32_t kp_q9;       /* output per error, 512 = 1.0; 0...16384 */
    int32_t ki_q15;      /* change of output per sample and error, 32768 = 1.0; 0...21845 */
    int32_t integral_q9; /* output, 512 = 1; adding to it is a feed-forward */
} pistate_type;

/** The controller's output. */
typedef struct {
    int32_t output;
} pioutput_type;

/** Voltages of the three phases, as InvClarke_Lib_Do returns them. Their sum need not be 0. */
typedef invclarkeoutput_type svminput_type;

/** The same with the zero sequence that centres them. */
typedef struct {
    int32_t va;
    int32_t vb;
    int32_t vc;
} svmoutput_type;

/**
 * Clarke transform of any three phase currents (the guide's EQ1 and EQ2 in their amplitude-invariant form):
 *     ialpha = (2 ia - ib - ic) / 3,  ibeta = (ib - ic) / sqrt(3)
 * A current common to all three has no effect. ialpha is the exact value correctly rounded, ibeta lies within 0.51 LSB of
 * it.
 */
void Clarke3_Lib_Do(const clarkeinput_type *threephasecurrent_ptr, clarkeoutput_type *twophaserefcurrent_ptr);

/**
 * Clarke transform of balanced currents measured in phases B and C; ia may hold anything:
 *     ialpha = -ib - ic,  ibeta = (ib - ic) / sqrt(3)
 * ialpha is exact, ibeta lies within 0.51 LSB of the exact value.
 */
void ClarkeBC_Lib_Do(const clarkeinput_type *threephasecurrent_ptr, clarkeoutput_type *twophaserefcurrent_ptr);

/**
 * Clarke transform of balanced currents measured in phases C and A; ib may hold anything:
 *     ialpha = ia,  ibeta = -(ia + 2 ic) / sqrt(3)
 * ialpha is exact, ibeta lies within 0.51 LSB of the exact value.
 */
void ClarkeCA_Lib_Do(const clarkeinput_type *threephasecurrent_ptr, clarkeoutput_type *twophaserefcurrent_ptr);

/**
 * cos and sin of angle_q32 (2^32 = one turn), with LIB_TRIG_FRAC fraction bits.
 * Within 0.35 / 32768 of the exact value plus the rounding of half a bit; with 15 fraction bits at most 0.85 LSB. Exact at
 * the four quadrants; with 31 fraction bits 1.0 saturates to INT32_MAX. Never beyond +-1.0.
 */
void SinCos_Lib_Do(uint32_t angle_q32, sincosoutput_type *sincosoutput_ptr);

/**
 * Length and angle of a vector: magnitude = sqrt(x^2 + y^2), angle_q32 = atan2(y, x).
 * magnitude is the exact value correctly rounded; it saturates from 2^31 on. The angle is exact on the axes, else within
 * 0.53 / 65536 turn; 0 for (0, 0).
 */
void Polar_Lib_Do(const polarinput_type *polarinput_ptr, polaroutput_type *polaroutput_ptr);

/**
 * PI controller with anti-windup, one sample, for 16-bit quantities:
 *     error = reference - measured,  output = kp error + integral within -limit...limit,  integral += ki error
 * (K. J. Astrom, T. Hagglund, "PID Controllers", 2nd ed., 1995: section 3.5, conditional integration). While the output is
 * limited, the integral takes no step further; steps back are always taken.
 * Every field is clamped to its range, and the rest is exact: error -98303...98303, limit 0...32766, kp and ki as their fields
 * say, the integral within +-2^29. The output is rounded down, the integral's step rounded down to 2^-9; nothing wraps.
 * Re-entrant with one state per context. Input and output may overlap; the state must not.
 */
void PI_Lib_Do(const piinput_type *piinput_ptr, pistate_type *pistate_ptr, pioutput_type *pioutput_ptr);

/**
 * Space-vector modulation by min-max zero sequence (D. G. Holmes, T. A. Lipo, "Pulse Width Modulation for Power Converters",
 * 2003, chapter 6): v - (max + min) / 2 for each of the three, whatever their sum.
 * The exact value, correctly rounded (ties up), for all int32_t values of all fields; it saturates only if the voltages include
 * INT32_MAX and INT32_MIN. The same is subtracted from all three: line-to-line voltages are unchanged to the bit.
 */
void SVM_Lib_Do(const svminput_type *svminput_ptr, svmoutput_type *svmoutput_ptr);

#ifdef __cplusplus
}
#endif

#endif
