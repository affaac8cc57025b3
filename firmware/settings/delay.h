/* SPDX-License-Identifier: MIT */
/*
 * How long a voltage takes from its sample: the one place that knows what a mode of the PWM's update (drivers/fabric/pwm.h)
 * and the number of samples a period mean for control.
 *
 * One sample a period. It stands in the middle of the low sides' time, and a winding integrates: from one to the next
 * its current changes by T / L times the mean voltage between them. A phase rises once before the high sides' middle and falls
 * once after it, each time by half of what its compare says. With u(k) for the voltage that answers sample k, that mean is
 *
 *   VALLEY  u(k - 1): both changes are an old compare's. Its middle lies 3 half periods after its sample
 *   ENDS    (u(k - 1) + u(k)) / 2: the rise is an old one's, the fall a new one's. 2 half periods
 *   ONCE    u(k): both are the new one's. 1 half period
 *
 * exactly, for any on-time and wherever within the period the changes lie: what the interrupt needs until its last compare
 * delays nothing in ONCE, it bounds the on-time that can still be met. A phase that is on for longer falls back to ENDS.
 *
 * So with a gain of L 2 pi f the loop is, z a period,
 *
 *   L(z) = a D(z) / (z - 1),  a = 2 pi f T,  D = 1 / z, (1 + 1 / z) / 2, 1
 *
 * and at an angle of x a period, for h half periods,
 *
 *   |L| = 1 where a = 2 sin(x / 2), or a = 2 tan(x / 2) for ENDS;  margin there = 90 degrees - h x / 2.
 *
 * Two samples a period, in the middle of the low sides' time and in that of the high sides'. Then T is half a PWM period, and
 * z half a period, too. Between two samples a phase changes once: it rises after the one and falls after the other, where the
 * compare says, and the mean voltage between them is the whole compare's.
 *
 *   VALLEY  is refused: every second sample would be answered by nothing
 *   ENDS    u(k - 1), in effect from the next end, which is the next sample: what VALLEY is with one
 *   ONCE    u(k)
 *
 * A phase that is on for too long rises before the answer to its sample is there, one that is on for too short falls so. Both
 * keep the old compare for half a period. They come together, as the longest and the shortest pulse of three: of the voltage
 * between these two phases half is then new and half is old in each half period, D = (1 + 1 / z) / 2, as of ENDS with one
 * sample.
 */
#ifndef FIRMWARE_SETTINGS_DELAY_H
#define FIRMWARE_SETTINGS_DELAY_H

#include <stdint.h>

#include "drivers/fabric/pwm.h"

/* The mode that with one sample a period has the same D. */
static inline enum pwm_update delay_alike(enum pwm_update update, int32_t samples)
{
    return samples == 2 && update == PWM_UPDATE_ENDS ? PWM_UPDATE_VALLEY : update;
}

/* From a sample to the middle of the voltage that answers it, in halves of the time between two samples. */
static inline int32_t delay_halves(enum pwm_update update, int32_t samples)
{
    return 3 - (int32_t)delay_alike(update, samples);
}

#endif
