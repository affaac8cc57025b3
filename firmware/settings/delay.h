/* SPDX-License-Identifier: MIT */
/*
 * How long a voltage takes from its sample: the one place that knows what a mode of the PWM's update (drivers/fabric/pwm.h)
 * means for control.
 *
 * The samples stand in the middle of the low sides' time, a PWM period apart, and a winding integrates: from one to the next
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
 */
#ifndef FIRMWARE_SETTINGS_DELAY_H
#define FIRMWARE_SETTINGS_DELAY_H

#include <stdint.h>

#include "drivers/fabric/pwm.h"

/* From a sample to the middle of the voltage that answers it, in half PWM periods. */
static inline int32_t delay_halves(enum pwm_update update)
{
    return 3 - (int32_t)update;
}

#endif
