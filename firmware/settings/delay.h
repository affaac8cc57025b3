/* SPDX-License-Identifier: MIT */
/*
 * The delay from sample to voltage: the one place that knows what PWM update mode (drivers/fabric/pwm.h) and samples per period
 * mean for control.
 *
 * One sample a period, in the middle of the low sides' on-time. A winding integrates: from one sample to the next its current
 * changes by T / L times the mean voltage between them. A phase rises once before the high sides' middle and falls once after
 * it, each set by half of its compare. With u(k) for the voltage calculated from sample k, that mean is
 *
 *   VALLEY  u(k - 1): both edges come from the old compare. Its middle is 3 half periods after its sample
 *   ENDS    (u(k - 1) + u(k)) / 2: the rise comes from the old one, the fall from the new. 2 half periods
 *   ONCE    u(k): both come from the new one. 1 half period
 *
 * exactly, for any on-time and any position of the edges in the period: in ONCE the interrupt's time up to its last compare
 * adds no delay, it bounds the on-time that can still be met. A phase that is on for longer falls back to ENDS.
 *
 * So with a gain of L 2 pi f the loop is, with z one period,
 *
 *   L(z) = a D(z) / (z - 1),  a = 2 pi f T,  D = 1 / z, (1 + 1 / z) / 2, 1
 *
 * and at an angle of x per period, for h half periods,
 *
 *   |L| = 1 at a = 2 sin(x / 2), or a = 2 tan(x / 2) for ENDS;  margin there = 90 degrees - h x / 2.
 *
 * Two samples a period, in the middle of the low sides' and of the high sides' on-time. T and z are then half a PWM period.
 * Between two samples a phase switches once, as its compare says: it rises after one and falls after the other, so the mean
 * voltage between them follows one compare entirely.
 *
 *   VALLEY  is refused: every second sample would have no effect
 *   ENDS    u(k - 1), in effect from the next end, which is the next sample: like VALLEY with one
 *   ONCE    u(k)
 *
 * A phase with too long an on-time rises before its new compare is ready, one with too short an on-time falls before it. Both
 * keep the old compare for half a period. They occur together, as the longest and the shortest of three pulses: the voltage
 * between these two phases is then half new and half old in each half period, D = (1 + 1 / z) / 2, as for ENDS with one sample.
 */
#ifndef FIRMWARE_SETTINGS_DELAY_H
#define FIRMWARE_SETTINGS_DELAY_H

#include <stdint.h>

#include "drivers/fabric/pwm.h"

/* The mode with the same D at one sample a period. */
static inline enum pwm_update delay_alike(enum pwm_update update, int32_t samples)
{
    return samples == 2 && update == PWM_UPDATE_ENDS ? PWM_UPDATE_VALLEY : update;
}

/* From a sample to the middle of its voltage, in halves of the sampling period. */
static inline int32_t delay_halves(enum pwm_update update, int32_t samples)
{
    return 3 - (int32_t)delay_alike(update, samples);
}

#endif
