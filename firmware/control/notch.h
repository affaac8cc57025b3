/* SPDX-License-Identifier: MIT */
/*
 * A notch in the torque demand, at the frequency of a coupling: its gain is 1 at rest and 0 there, whichever way the phase has
 * turned by then. Zeros on the unit circle at the angle w, poles at NOTCH_RADIUS on the same ray:
 *
 *     y0 = g (x0 - c x1 + x2) + r c y1 - r^2 y2      c = 2 cos w,  g = (1 - r c + r^2) / (2 - c)
 *
 * Wide, so that a stiffness that changes by a tenth stays in it; its lag far below is about that of a millisecond.
 */
#ifndef FIRMWARE_CONTROL_NOTCH_H
#define FIRMWARE_CONTROL_NOTCH_H

#include <stdbool.h>
#include <stdint.h>

#define NOTCH_C_MOST_Q13 13255 /* 100 Hz at 1 kHz: below it the notch would be as slow as the loop, and amplify above */

struct notch {
    bool on;
    int32_t c_q13, rc_q13, gain_q13;
    int32_t x[2], y[2]; /* the last two, latest first */
};

/* Range of `c_q13`: -2.0 to NOTCH_C_MOST_Q13. Starts without a step, from the demand there is. */
void notch_set(struct notch *n, int32_t c_q13, int32_t demand);

/* As after this demand for ever. */
void notch_reset(struct notch *n, int32_t demand);

/* Range: |x| < 2^31; saturates. */
int32_t notch_step(struct notch *n, int32_t x);

#endif
