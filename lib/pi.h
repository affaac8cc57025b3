/* SPDX-License-Identifier: MIT */
/*
 * A PI controller with feedforward and anti-windup, on Q15 values:
 *     output = clamp(kp error + integral + feedforward),  integral += ki error
 *
 * Anti-windup, two rules:
 *  1. Where the output would exceed its limit, the integrator takes no step further in that direction; steps back are
 *     always taken (conditional integration). So a long saturation stores nothing: the output leaves the limit as soon
 *     as the proportional part allows it.
 *  2. The integrator itself stays within +-limit, also when the limit shrinks (a falling bus voltage, the d axis taking
 *     the voltage). This bounds it whatever the feedforward says, and makes overflow impossible.
 * The alternative, to pull the integrator down by whatever the output exceeds, was not taken: one step of the reference
 * then empties it through the proportional part, and the disturbance it held must be learnt again.
 */
#ifndef LIB_PI_H
#define LIB_PI_H

#include "lib/q15.h"

/** Gains and state. kp = output per error. ki = Ki * Ts: change of output per sample and error. Both >= 0. */
struct pi_q15 {
    int32_t kp_q12;       /* 0...32767: 0...7.9997 */
    int32_t ki_q17;       /* 0...32767: 0...0.25 */
    int32_t integral_q30; /* Q15 output with 15 more bits; |integral_q30| <= 2^30 */
};

/** Forget the past. */
static inline void pi_q15_reset(struct pi_q15 *pi)
{
    pi->integral_q30 = 0;
}

/**
 * Bumpless start: choose the integrator so that the next step with error 0 and this feedforward gives this output,
 * as far as +-1.0 of integrator allows. Range: |output_q15 - feedforward_q15| < 2^31.
 */
static inline void pi_q15_preset(struct pi_q15 *pi, int32_t output_q15, int32_t feedforward_q15)
{
    pi->integral_q30 = q15_clamp(output_q15 - feedforward_q15, -Q15_ONE, Q15_ONE) * 32768;
}

/** Rule 1: limit the output, and where it was limited, the integrator's step to the way back. */
static inline void pi_q15_saturate(int32_t *output_q15, int32_t *step_q30, int32_t limit_q15)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE) /* the compiler would branch */
    __asm__("cmp    %[output], %[limit]\n\t"
            "itt    gt\n\t"
            "movgt  %[output], %[limit]\n\t"
            "andgt  %[step], %[step], %[step], asr #31\n\t"
            "cmn    %[output], %[limit]\n\t"
            "itt    lt\n\t"
            "rsblt  %[output], %[limit], #0\n\t"
            "biclt  %[step], %[step], %[step], asr #31"
            : [output] "+&r"(*output_q15), [step] "+&r"(*step_q30)
            : [limit] "r"(limit_q15)
            : "cc");
#else
    if (*output_q15 > limit_q15) {
        *output_q15 = limit_q15;
        *step_q30 = q15_min(*step_q30, 0);
    } else if (*output_q15 < -limit_q15) {
        *output_q15 = -limit_q15;
        *step_q30 = q15_max(*step_q30, 0);
    }
#endif
}

/**
 * One sample. Returns the output, Q15, in -limit_q15...limit_q15.
 * error_q15: any value, saturated to 16 bits. |feedforward_q15| <= 65536. 0 <= limit_q15 <= 32768.
 * The output is rounded once, to nearest; each integrator step to nearest 2^-30. Context: one caller an instance.
 */
static inline int32_t pi_q15_step(struct pi_q15 *pi, int32_t error_q15, int32_t feedforward_q15, int32_t limit_q15)
{
    const int32_t error = q15_sat16(error_q15);
    const int32_t integral_limit = limit_q15 * 32768;
    int32_t step = (pi->ki_q17 * error + 2) >> 2;
    int32_t output = (pi->kp_q12 * error + ((pi->integral_q30 + step) >> 3) + feedforward_q15 * 4096 + 2048) >> 12;

    pi_q15_saturate(&output, &step, limit_q15);
    pi->integral_q30 = q15_clamp(pi->integral_q30 + step, -integral_limit, integral_limit);
    return output;
}

#endif
