/* SPDX-License-Identifier: MIT */
/*
 * Feeds forward Coulomb friction for the commanded direction, so the speed loop need not find it again at each reversal while
 * the shaft is at rest.
 *
 * It uses the reference, not the speed: with the speed, a friction set too large would drive the shaft. Near 0 it is
 * proportional to the reference, with the speed loop's own gain; a quarter of that if a position loop sets the reference,
 * because it adds that much stiffness to the loop.
 */
#ifndef FIRMWARE_CONTROL_FRICTION_H
#define FIRMWARE_CONTROL_FRICTION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/speed_loop.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning.h"

#define FRICTION_POSITION_SHIFT 2

/* Friction torque, Q15, in the reference's direction; at most t->friction_q15. Slow loop. */
static inline int32_t friction_torque_q15(const struct speed_loop *s, const struct tuning *t, bool position)
{
    const int32_t slope_q16 = (int32_t)(((int64_t)s->kp_q16 * speed_loop_share_q14(&s->estimate)) >> 14);
    const int64_t answer_q15 = ((int64_t)s->ref_rpm_q16 * slope_q16) >> (28 + (position ? FRICTION_POSITION_SHIFT : 0));
    return scale_clamp(answer_q15, -t->friction_q15, t->friction_q15);
}

#endif
