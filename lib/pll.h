/* SPDX-License-Identifier: MIT */
/*
 * A second-order tracking observer (type-2 PLL) for a measured angle: it smooths the steps of an encoder and gives the
 * speed without differentiating. Once a sample, with all angles as fractions of a turn in 32 bits (they wrap by
 * themselves):
 *
 *     predicted = angle + speed
 *     error     = measured - predicted
 *     angle     = predicted + kp error
 *     speed     = speed + ki error
 *
 * Its poles are the roots of z^2 - (2 - kp - ki) z + (1 - kp). For a natural frequency w (rad/s), damping D and sample
 * time Ts, with x = w Ts << 1:     kp = 2 D x,     ki = x^2
 * and exactly:     kp = 1 - exp(-2 D x),     ki = 2 - kp - 2 exp(-D x) cos(x sqrt(1 - D^2))
 * Bandwidth (-3 dB of angle): w sqrt(1 + 2 D^2 + sqrt((1 + 2 D^2)^2 + 1)), that is 2.48 w for D = 1.
 * No error at constant speed. At a constant acceleration (turns per sample^2) the angle lags by acceleration (1 - kp) / ki,
 * the speed by acceleration (kp / ki - 1/2).
 *
 * The error enters with its upper 16 bits, rounded: 32-bit products suffice, and an error below 2^-17 turn counts as
 * none, so that at standstill the observer comes to rest.
 */
#ifndef LIB_PLL_H
#define LIB_PLL_H

#include "lib/q15.h"

/** Gains and state. The speed is in turns per sample: 2^32 = one turn a sample. */
struct pll {
    uint32_t angle_q32;
    int32_t speed_q32;
    int32_t kp_q16; /* 0...65535: 0...1 */
    int32_t ki_q22; /* 0...65535: 0...1/64, so x <= 0.125: 398 Hz at 20 kHz */
};

/** Start at an angle, at rest. The gains stay. */
static inline void pll_reset(struct pll *pll, uint32_t angle_q32)
{
    pll->angle_q32 = angle_q32;
    pll->speed_q32 = 0;
}

/**
 * Gains for critical damping (D = 1) at x = w Ts, given in Q16: 2 pi f / f_sample * 65536, range 0...8191 (x < 0.125).
 * Uses the first-order formulas above. Not for the hot path.
 */
static inline void pll_set_bandwidth(struct pll *pll, uint32_t natural_q16)
{
    pll->kp_q16 = (int32_t)(2U * natural_q16);
    pll->ki_q22 = (int32_t)((natural_q16 * natural_q16 + 512U) >> 10);
}

/** One sample. Range: |speed| < 1/2 turn a sample. Context: ISR, one caller an instance; no long multiply, no branch. */
static inline void pll_step(struct pll *pll, uint32_t measured_q32)
{
    const uint32_t predicted_q32 = pll->angle_q32 + (uint32_t)pll->speed_q32;
    const int32_t error_q16 = (int32_t)(measured_q32 - predicted_q32 + 0x8000U) >> 16;

    pll->angle_q32 = predicted_q32 + (uint32_t)(error_q16 * pll->kp_q16);
    pll->speed_q32 = (int32_t)((uint32_t)pll->speed_q32 + (uint32_t)((error_q16 * pll->ki_q22) >> 6));
}

#endif
