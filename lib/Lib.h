/* SPDX-License-Identifier: MIT */
/*
 * Clarke, Park and their inverses on 32-bit data: a replacement for the transform library of Microsemi's "Park, Inverse
 * Park and Clarke, Inverse Clarke Transformations, MSS Software Implementation, User Guide" (2013; "the guide" below),
 * with its types, field order, functions and parameter names. C and C++.
 *
 * Currents and voltages are integers in any unit, over the whole int32_t range, INT32_MIN included: the transforms are linear,
 * so scale does not matter. cos and sin are fractions with LIB_TRIG_FRAC bits; by default 15: 1.0 = 32768.
 *
 * Every function, for every input:
 *   rounding    to nearest; a tie goes up (InvClarke's vc: down, see there). Accuracy is stated per function.
 *   saturation  to INT32_MIN / INT32_MAX if the exact value does not fit; nothing wraps, nothing changes sign.
 *   aliasing    input and output may overlap in memory; all fields are read before the first is written.
 *   context     any: thread or interrupt, re-entrant. No state, no static memory; 8 bytes of stack (Lib_thumb2.S).
 *   time        no branch on data. The cycles below are those of `make bench` on a Cortex-M3 with Lib_thumb2.S: call and
 *               return included, memory without wait states, the longest over all data; its multiplier is quicker where
 *               an operand is 0 or in 0...65535. Lib.c does the same in portable C.
 * Pointers must not be null, and must be aligned to 4 bytes.
 */
#ifndef LIB_H
#define LIB_H

#ifndef LIB_TRIG_FRAC
/** Fraction bits of every cos and sin field, 1...31. The library and its users must be built with the same value,
 * a number in decimal digits: else they do not link. */
#define LIB_TRIG_FRAC 15
#endif

#if (LIB_TRIG_FRAC) < 1 || (LIB_TRIG_FRAC) > 31
#error "LIB_TRIG_FRAC must be 1...31"
#endif

#define LIB_PASTED(function, frac) function##_LIB_TRIG_FRAC_##frac
#define LIB_CALLED(function, frac) LIB_PASTED(function, frac)

#ifndef __ASSEMBLER__ /* Lib_thumb2.S takes the definitions above from here */

#include <stdint.h>

/*
 * A library that was built for another LIB_TRIG_FRAC than its user does not link: what takes cos and sin is called by a name
 * that ends in _LIB_TRIG_FRAC_ and the number. The plain names are there as well, for who declares them himself.
 */
#if defined(__PRAGMA_REDEFINE_EXTNAME) && defined(__ELF__) && !defined(LIB_DEFINES)
#pragma redefine_extname Park_Lib_Do LIB_CALLED(Park_Lib_Do, LIB_TRIG_FRAC)
#pragma redefine_extname InvPark_Lib_Do LIB_CALLED(InvPark_Lib_Do, LIB_TRIG_FRAC)
#endif

#ifdef __cplusplus
extern "C" {
#endif

/** Currents of the three phases; ic is not used by Clarke_Lib_Do and may hold anything. */
typedef struct {
    int32_t ia;
    int32_t ib;
    int32_t ic;
} clarkeinput_type;

/** Currents in the stationary frame; alpha lies along phase A. Amplitude-invariant: |(ialpha, ibeta)| is a phase's peak. */
typedef struct {
    int32_t ialpha;
    int32_t ibeta;
} clarkeoutput_type;

/** Voltages in the stationary frame. */
typedef struct {
    int32_t valpha;
    int32_t vbeta;
} invclarkeinput_type;

/** Voltages of the three phases against the star point. */
typedef struct {
    int32_t va;
    int32_t vb;
    int32_t vc;
} invclarkeoutput_type;

/** Currents in the stationary frame, and cosine and sine of the electrical angle with LIB_TRIG_FRAC fraction bits. */
typedef struct {
    int32_t ialpha;
    int32_t ibeta;
    int32_t cos;
    int32_t sin;
} parkinput_type;

/** Currents in the rotor frame; d lies along the magnet's flux. */
typedef struct {
    int32_t id;
    int32_t iq;
} parkoutput_type;

/** Voltages in the rotor frame, and cosine and sine of the electrical angle with LIB_TRIG_FRAC fraction bits. */
typedef struct {
    int32_t vd;
    int32_t vq;
    int32_t cos;
    int32_t sin;
} invparkinput_type;

/** Voltages in the stationary frame. */
typedef struct {
    int32_t valpha;
    int32_t vbeta;
} invparkoutput_type;

/**
 * Clarke transform of balanced currents (the guide's EQ3 and EQ4 with ic = -ia - ib):
 *     ialpha = ia,  ibeta = (ia + 2 ib) / sqrt(3)
 * ialpha is exact. ibeta lies within 0.583 LSB of the exact value; it is the exact value rounded to nearest if ia is even and
 * both fit 17 bits. It never falls as ia or ib rises. 23 cycles.
 */
void Clarke_Lib_Do(const clarkeinput_type *threephasecurrent_ptr, clarkeoutput_type *twophaserefcurrent_ptr);

/**
 * Inverse Clarke transform (the guide's EQ5 to EQ7):
 *     va = valpha,  vb = (-valpha + sqrt(3) vbeta) / 2,  vc = (-valpha - sqrt(3) vbeta) / 2
 * va is exact. vb and vc lie within 0.621 LSB of the exact value, and are the exact value rounded to nearest if vbeta fits 17
 * bits. A tie, which needs vbeta = 0, goes up in vb and down in vc: so va + vb + vc = 0 always, unless one of them saturates.
 * 26 cycles.
 */
void InvClarke_Lib_Do(const invclarkeinput_type *invclarkeinput_ptr, invclarkeoutput_type *invclarkeoutput_ptr);

/**
 * Park transform (the guide's EQ8 and EQ9):
 *     id = ialpha cos + ibeta sin,  iq = ibeta cos - ialpha sin
 * The exact value, correctly rounded (ties up), for all int32_t values of all four fields, including cos and sin beyond +-1.0
 * or off the unit circle. 54 cycles.
 */
void Park_Lib_Do(const parkinput_type *parkinput_ptr, parkoutput_type *parkoutput_ptr);

/**
 * Inverse Park transform (the guide's EQ10 and EQ11):
 *     valpha = vd cos - vq sin,  vbeta = vq cos + vd sin
 * The exact value, correctly rounded (ties up), for all int32_t values of all four fields, as in Park_Lib_Do. 54 cycles.
 */
void InvPark_Lib_Do(const invparkinput_type *invparkinput_ptr, invparkoutput_type *invparkoutput_ptr);

#ifdef __cplusplus
}
#endif

#endif /* __ASSEMBLER__ */

#endif
