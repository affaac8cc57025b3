/* SPDX-License-Identifier: MIT */
/* A step of the speed loop (speed_loop.h), inlined into its caller. Rare cases stay in speed_loop.c. */
#ifndef FIRMWARE_CONTROL_SPEED_LOOP_STEP_H
#define FIRMWARE_CONTROL_SPEED_LOOP_STEP_H

#include "firmware/control/speed_loop.h"
#include "lib/q15.h"
#include "lib/usually.h"

#define SPEED_LOOP_ONE_Q29    (1 << 29)
#define SPEED_LOOP_SLOW_SHIFT 2 /* of the bandwidth, if torque is slow: kp scales with it, ki with its square */

/* Rare: edges far apart; a response of a quarter of the largest current; an averaged torque demand. */
int32_t speed_loop_memory_q16(const struct speed_loop *s, const struct tuning *t, int32_t share_q14);
void speed_loop_count_swing(struct speed_loop *s);
int32_t speed_loop_mean_q15(struct speed_loop *s, int32_t mean_ms, int32_t wish_q15);

/* The step from `here` to `target`, `most` at most; the distance may take 32 bits and a sign. */
static inline int32_t speed_loop_towards(int32_t target, int32_t here, int32_t most)
{
    const uint32_t distance = (uint32_t)target - (uint32_t)here;
    if (target >= here) {
        return distance < (uint32_t)most ? (int32_t)distance : most;
    }
    return -distance < (uint32_t)most ? (int32_t)distance : -most;
}

/*
 * Moves the reference towards the command and returns the wanted step, in rpm Q16. While the current is at its limit and the
 * rotor lags, the reference waits; the feed-forward keeps asking for full torque.
 */
static inline int32_t speed_loop_ramp(struct speed_loop *s, int32_t slope_q16)
{
    const int32_t step = speed_loop_towards(s->target_rpm_q16, s->ref_rpm_q16, slope_q16);
    const int32_t ahead_q4 = s->speed_ref_rpm_q4 - s->speed_rpm_q4;
    if (USUALLY(!s->at_limit) || (step > 0 ? ahead_q4 <= 0 : ahead_q4 >= 0)) {
        s->ref_rpm_q16 += step;
    }
    s->speed_ref_rpm_q4 = s->ref_rpm_q16 >> 12;
    return step;
}

/* Large gain, small error; the product has 13 bits too many. */
static inline int32_t speed_loop_answer_q29(const struct speed_loop *s, int32_t error_q15, int32_t gain_q16)
{
    return (int32_t)(((int64_t)q15_clamp(error_q15, -s->error_max_q15, s->error_max_q15) * gain_q16) >> 13);
}

/* At most +-1.0: the product's upper word tells. */
static inline int32_t speed_loop_feedforward_q29(const struct tuning *t, int32_t moved_q16)
{
    const int64_t wanted_q39 = (int64_t)t->speed_accel_q8 * moved_q16;
    const int32_t high_q7 = (int32_t)(wanted_q39 >> 32);
    return high_q7 >= 1 << 7 ? SPEED_LOOP_ONE_Q29
                             : (high_q7 < -(1 << 7) ? -SPEED_LOOP_ONE_Q29 : (int32_t)(wanted_q39 >> 10));
}

/* In Q29 a torque has 14 bits beyond Q15: a response of +-2.0, feed-forward of +-1.0 and a smaller integral sum fit 32 bits. */
static inline int32_t __attribute__((always_inline))
speed_loop_control(struct speed_loop *s, const struct tuning *t, int32_t moved_q16, const struct interval *limits)
{
    const int32_t ref_rpm_q15 = s->ref_rpm_q16 >> 1;
    const int32_t low_q29 = limits->low * (1 << 14);
    const int32_t high_q29 = limits->high * (1 << 14);
    int32_t error_q15 = ref_rpm_q15 - s->estimate.speed_rpm_q15;
    int32_t ki_q16 = s->ki_q16;
    if (SELDOM(s->estimate.interval_clocks > SPEED_LOOP_FULL_GAIN_CLOCKS)) {
        const int32_t share = speed_loop_share_q14(&s->estimate);
        ki_q16 = speed_loop_memory_q16(s, t, share);
        error_q15 = (int32_t)(((int64_t)error_q15 * share) >> 14);
    }
    if (SELDOM(s->torque_is_slow)) {
        error_q15 >>= SPEED_LOOP_SLOW_SHIFT;
        ki_q16 >>= 2 * SPEED_LOOP_SLOW_SHIFT;
    }
    const int32_t answer = speed_loop_answer_q29(s, error_q15, s->kp_q16);
    const int32_t wanted_q29 =
        s->integral_q29 + answer + (moved_q16 != 0 ? speed_loop_feedforward_q29(t, moved_q16) : 0);
    s->swing_ms++;
    if (SELDOM((answer >> 14) * s->swing > t->i_max_q15 >> 2)) {
        speed_loop_count_swing(s);
    }
    s->at_limit = wanted_q29 < low_q29 || wanted_q29 > high_q29;
    /* integrate unless that would push further into the limit */
    const int32_t growth_q29 = speed_loop_answer_q29(s, ref_rpm_q15 - s->estimate.travel_q15, ki_q16);
    if (!s->at_limit || (growth_q29 > 0) != (wanted_q29 > 0)) {
        s->integral_q29 = q15_clamp(s->integral_q29 + growth_q29, low_q29, high_q29);
    }
    return SELDOM(t->torque_mean_ms > 1) ? speed_loop_mean_q15(s, t->torque_mean_ms, wanted_q29 >> 14)
                                         : wanted_q29 >> 14;
}

static inline int32_t __attribute__((always_inline))
speed_loop_ramp_step(struct speed_loop *s, const struct tuning *t, int32_t slope_q16, const struct interval *limits)
{
    const int32_t moved_q16 = speed_loop_ramp(s, slope_q16);
    return speed_loop_control(s, t, moved_q16, limits);
}

#endif
