/* SPDX-License-Identifier: MIT */
#include "firmware/control/speed_loop.h"

static int64_t clamp(int64_t x, int64_t low, int64_t high)
{
    return x < low ? low : (x > high ? high : x);
}

void speed_loop_measure(struct speed_loop *s, const volatile struct current_loop *c, const struct tuning *t)
{
    s->speed_rpm_q4 = tuning_rpm_q4(t, c->pll.speed_q32);
}

void speed_loop_reset(struct speed_loop *s, int32_t torque_q15)
{
    s->ref_rpm_q16 = s->speed_rpm_q4 * (1 << 12);
    s->target_rpm_q16 = s->ref_rpm_q16;
    s->speed_ref_rpm_q4 = s->speed_rpm_q4;
    s->integral_q16 = (int64_t)torque_q15 * 65536;
    s->at_limit = false;
}

/* Moves the reference towards the command and returns by how much, in rpm Q16. */
static int32_t ramp(struct speed_loop *s, int32_t slope_q16)
{
    const int64_t distance = (int64_t)s->target_rpm_q16 - s->ref_rpm_q16;
    const int32_t step = (int32_t)clamp(distance, -slope_q16, slope_q16);
    s->ref_rpm_q16 += step;
    s->speed_ref_rpm_q4 = s->ref_rpm_q16 >> 12;
    return step;
}

int32_t speed_loop_step(struct speed_loop *s, const struct tuning *t, int32_t slope_q16, const struct interval *limits)
{
    const int32_t moved_q16 = ramp(s, slope_q16);
    const int64_t error_q4 = s->speed_ref_rpm_q4 - s->speed_rpm_q4;
    const int64_t low_q16 = (int64_t)limits->low * 65536;
    const int64_t high_q16 = (int64_t)limits->high * 65536;
    const int64_t feedforward_q16 = ((int64_t)t->speed_accel_q8 * moved_q16) >> 8;
    const int64_t fixed_q16 = error_q4 * t->speed_kp_q16 + feedforward_q16;
    const int64_t wanted_q16 = fixed_q16 + s->integral_q16;
    s->at_limit = wanted_q16 < low_q16 || wanted_q16 > high_q16;
    /* integrate unless that would push further into the limit */
    const int64_t growth_q16 = error_q4 * t->speed_ki_q16;
    if (!s->at_limit || (growth_q16 > 0) != (wanted_q16 > 0)) {
        s->integral_q16 = clamp(s->integral_q16 + growth_q16, low_q16, high_q16);
    }
    return (int32_t)(clamp(wanted_q16, INT32_MIN, INT32_MAX) >> 16);
}
