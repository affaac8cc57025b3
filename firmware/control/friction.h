/* SPDX-License-Identifier: MIT */
/*
 * The torque of Coulomb friction, by the direction in which the shaft is to turn: fed forward, so that the speed loop need not
 * find it anew at each reversal, while the shaft stands.
 *
 * By the reference and not by the speed: a friction that is told too large would else drive the shaft by itself. About 0 it
 * goes with the reference, as steep as the speed loop's own answer is there; a quarter as steep where a position loop sets the
 * reference, for this makes that loop stiffer by as much.
 */
#ifndef FIRMWARE_CONTROL_FRICTION_H
#define FIRMWARE_CONTROL_FRICTION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/speed_loop.h"
#include "firmware/settings/tuning.h"

#define FRICTION_POSITION_SHIFT 2

/* Torque, Q15, that the reference's direction takes; at most t->friction_q15. Slow loop. */
static inline int32_t friction_torque_q15(const struct speed_loop *s, const struct tuning *t, bool position)
{
    const int32_t slope_q16 = (int32_t)(((int64_t)s->kp_q16 * speed_loop_share_q14(&s->estimate)) >> 14);
    const int64_t answer_q15 = ((int64_t)s->ref_rpm_q16 * slope_q16) >> (28 + (position ? FRICTION_POSITION_SHIFT : 0));
    const int32_t most_q15 = t->friction_q15;
    return answer_q15 > most_q15 ? most_q15 : (answer_q15 < -most_q15 ? -most_q15 : (int32_t)answer_q15);
}

#endif
