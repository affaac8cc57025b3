/* SPDX-License-Identifier: MIT */
#include "firmware/drive/retune.h"

#include "firmware/axis/axis.h"
#include "lib/q15.h"

#define SOFTENED_Q8 179 /* 0.7 */

void retune_to(struct axis *a, const struct tuning *t)
{
    a->tuning = *t;
    speed_loop_tune(&a->speed, t);
}

void retune_source(struct axis *a, uint32_t angle_source, int32_t speed_ki_min_q16)
{
    a->tuning.angle_source = angle_source;
    a->tuning.speed_ki_min_q16 = speed_ki_min_q16;
}

static int32_t gain_reductions(int32_t gain)
{
    return q15_max((int32_t)(((int64_t)gain * SOFTENED_Q8) >> 8), 1);
}

void retune_softened(struct axis *a)
{
    struct tuning *const t = &a->tuning;
    t->speed_accel_q8 = gain_reductions(t->speed_accel_q8);
    t->speed_kp_q16 = gain_reductions(t->speed_kp_q16);
    t->speed_ki_q16 = gain_reductions(gain_reductions(t->speed_ki_q16));
    speed_loop_soften(&a->speed, gain_reductions(a->speed.kp_q16), gain_reductions(gain_reductions(a->speed.ki_q16)));
}
