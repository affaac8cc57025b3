/* SPDX-License-Identifier: MIT */
/*
 * A second-order tracking observer (type-2 PLL) for a measured angle: it smooths an encoder's steps and gives the speed without
 * differentiation. Once per sample, with all angles as 32-bit fractions of a turn (they wrap by themselves):
 *
 *     error  = measured - angle
 *     speed += error / 256
 *     angle += error / 8 + speed         the prediction for the next sample
 *
 * Its poles are the roots of z^2 - (2 - kp - ki) z + (1 - kp), with kp = 1/8 and ki = 1/256: 0.951 and 0.920, about a double
 * pole at x = w Ts = 1/16 (kp = 2 D x, ki = x^2 with damping D = 1), 199 Hz at 20 kHz. Fixed, because powers of two cost
 * nothing: a slower observer lags and costs a speed loop damping, a faster one passes the encoder's steps on to the torque.
 * Bandwidth (-3 dB of the predicted angle): 0.0266 of the sampling rate, 533 Hz at 20 kHz. At constant speed the only error is
 * from rounding down: angle behind by 0...256 units (2^-24 turn), speed by 0...32. At standstill it comes to rest. At a
 * constant acceleration (turns per sample^2) the predicted angle lags by 256 accelerations, the speed by 31.5, at the instant
 * of the sample. It locks from any angle, onto a speed within 0.15 turn a sample of its own.
 *
 * The stored angle is a prediction: it is ready before its sample, so nothing waits for it.
 */
#ifndef LIB_PLL_H
#define LIB_PLL_H

#include "lib/factors.h"
#include "lib/q15.h"

/** The speed is in turns per sample: 2^32 = one turn a sample. */
struct pll {
    uint32_t angle_q32; /* predicted for the next sample */
    int32_t speed_q32;
};

/** Start at an angle, at rest. */
static inline void pll_reset(struct pll *pll, uint32_t angle_q32)
{
    pll->angle_q32 = angle_q32;
    pll->speed_q32 = 0;
}

/**
 * One sample with gains kp = 2^-kp_shift and ki = 2^-ki_shift. A double pole, at x = 2^-(kp_shift + 1), if ki_shift is 2
 * kp_shift + 2. Range: |speed| < 1/2 turn a sample. Context: ISR, one caller per instance. 4 cycles without loads and stores.
 */
static inline void pll_track(struct pll *pll, uint32_t measured_q32, unsigned kp_shift, unsigned ki_shift)
{
    const int32_t error_q32 = (int32_t)(measured_q32 - pll->angle_q32);

    pll->speed_q32 = (int32_t)((uint32_t)pll->speed_q32 + (uint32_t)(error_q32 >> ki_shift));
    pll->angle_q32 += (uint32_t)(error_q32 >> kp_shift) + (uint32_t)pll->speed_q32;
}

/** The same with the gains above. */
static inline void pll_step(struct pll *pll, uint32_t measured_q32)
{
    pll_track(pll, measured_q32, PLL_KP_SHIFT, PLL_KI_SHIFT);
}

#endif
