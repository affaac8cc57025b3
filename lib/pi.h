/* SPDX-License-Identifier: MIT */
/*
 * A PI controller with anti-windup:
 *     output = clamp(kp error + integral),  integral += ki error
 * The integral takes the error's step after the output, so nothing waits for it; kp + ki in place of kp gives the form that
 * integrates first.
 *
 * Anti-windup: while the output is limited, the integral takes no step further in that direction; steps back are always taken
 * (conditional integration). So a long saturation stores nothing: the output leaves the limit as soon as the proportional part
 * allows it. We rejected the alternative, reducing the integral by the output's excess: one reference step then empties it
 * through the proportional part, and it must relearn the disturbance.
 *
 * A feed-forward is part of the integral. A caller that knows the required change adds it to the integral; the hot path pays
 * nothing, and the anti-windup takes it into account.
 */
#ifndef LIB_PI_H
#define LIB_PI_H

#include "lib/factors.h"
#include "lib/q15.h"

#define PI_OUTPUT_MAX      32766 /* largest limit: just below 16-bit saturation, so exceeding it stays detectable */
#define PI_ERROR_MAX       98303 /* |reference| <= 32768 less |measured| <= 65535 */
#define PI_KP_MAX_Q9       16384 /* 32.0: with the largest error and integral still below 2^31 */
#define PI_KI_MAX_Q15      21845 /* 0.67, same condition */
#define PI_INTEGRAL_MAX_Q9 (1 << 29)

/** Gains and state, in units of output per LSB of error. ki = Ki Ts: change of output per sample and error. Both >= 0. */
struct pi_q15 {
    int32_t kp_q9;
    int32_t ki_q15;
    int32_t
        integral_q9; /* stays within +-(32768 + the largest step) by itself; callers that add to it must stay within +-2^29 */
};

/**
 * The controller's demand before any limit: kp error + integral, rounded down, saturated to 16 bits. |error| <= PI_ERROR_MAX,
 * |integral_q9| <= PI_INTEGRAL_MAX_Q9. Context: any. 4 cycles.
 */
static inline int32_t pi_q15_unlimited(int32_t kp_q9, int32_t error, int32_t integral_q9)
{
    return q15_sat16((kp_q9 * error + integral_q9) >> PI_SHIFT);
}

/**
 * The integral's step, Q15, unless the output was limited in its direction: the demand exceeds the output. Any values. Context:
 * any. 4 cycles.
 */
static inline int32_t pi_q15_hold(int32_t step_q15, int32_t unlimited, int32_t output)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE) /* the compiler would branch */
    __asm__("cmp    %[unlimited], %[output]\n\t"
            "it     gt\n\t"
            "andgt  %[step], %[step], %[step], asr #31\n\t"
            "it     lt\n\t"
            "biclt  %[step], %[step], %[step], asr #31"
            : [step] "+r"(step_q15)
            : [unlimited] "l"(unlimited), [output] "l"(output)
            : "cc");
    return step_q15;
#else
    if (unlimited > output) {
        return q15_min(step_q15, 0);
    }
    return unlimited < output ? q15_max(step_q15, 0) : step_q15;
#endif
}

/**
 * Limits the output to +-limit, and holds the step if that limits it, in one go. limit >= 0, the others any values. Context:
 * any. 6 cycles.
 */
static inline void pi_q15_saturate(int32_t *output, int32_t *step_q15, int32_t limit)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE)
    __asm__("cmp    %[output], %[limit]\n\t"
            "itt    gt\n\t"
            "movgt  %[output], %[limit]\n\t"
            "andgt  %[step], %[step], %[step], asr #31\n\t"
            "cmn    %[output], %[limit]\n\t"
            "itt    lt\n\t"
            "rsblt  %[output], %[limit], #0\n\t"
            "biclt  %[step], %[step], %[step], asr #31"
            : [output] "+&l"(*output), [step] "+&r"(*step_q15)
            : [limit] "l"(limit)
            : "cc");
#else
    const int32_t unlimited = *output;
    *output = q15_clamp(unlimited, -limit, limit);
    *step_q15 = pi_q15_hold(*step_q15, unlimited, *output);
#endif
}

/** The integral after a step, rounded down to 2^-9. Context: any. 1 cycle. */
static inline int32_t pi_q15_integrated(int32_t integral_q9, int32_t step_q15)
{
    return integral_q9 + (step_q15 >> PI_STEP_SHIFT);
}

/**
 * One sample: the output in -limit...limit. |error| <= PI_ERROR_MAX, 0 <= limit <= PI_OUTPUT_MAX. Context: one caller per
 * instance. 12 cycles without loads and stores.
 */
static inline int32_t pi_q15_step(struct pi_q15 *pi, int32_t error, int32_t limit)
{
    int32_t output = pi_q15_unlimited(pi->kp_q9, error, pi->integral_q9);
    int32_t step_q15 = pi->ki_q15 * error;

    pi_q15_saturate(&output, &step_q15, limit);
    pi->integral_q9 = pi_q15_integrated(pi->integral_q9, step_q15);
    return output;
}

#endif
