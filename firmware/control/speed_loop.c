/* SPDX-License-Identifier: MIT */
#include "firmware/control/speed_loop.h"

#include "firmware/control/speed_loop_step.h"

#define HUNT_MS          32u
#define HUNT_SWINGS      4u
#define ERROR_TIMES_GAIN ((1LL << 43) - 1) /* 2.0 in Q29, before the shift of answer_q29() */
#define CALMEST          10u               /* quarters: a sixteenth of the gains is left */

void speed_loop_take(struct speed_loop *s, int32_t speed_rpm_q15, int32_t travel_q15, uint32_t clocks)
{
    speed_estimate_take(&s->estimate, speed_rpm_q15, travel_q15, clocks);
    s->speed_rpm_q4 = speed_rpm_q15 >> 11;
}

void speed_loop_init(struct speed_loop *s)
{
    *s = (struct speed_loop){.swing = 1};
    speed_estimate_reset(&s->estimate);
}

void speed_loop_soften(struct speed_loop *s, int32_t kp_q16, int32_t ki_q16)
{
    s->kp_q16 = kp_q16;
    s->ki_q16 = ki_q16;
    const int64_t error_max_q15 = ERROR_TIMES_GAIN / kp_q16;
    s->error_max_q15 = error_max_q15 > INT32_MAX ? INT32_MAX : (int32_t)error_max_q15;
}

void speed_loop_tune(struct speed_loop *s, const struct tuning *t)
{
    speed_loop_soften(s, t->speed_kp_q16, t->speed_ki_q16);
    s->calmed = 0;
    s->swings = 0;
}

void speed_loop_reset(struct speed_loop *s, int32_t torque_q15)
{
    s->ref_rpm_q16 = s->estimate.speed_rpm_q15 * 2;
    s->target_rpm_q16 = s->ref_rpm_q16;
    s->speed_ref_rpm_q4 = s->speed_rpm_q4;
    s->integral_q29 = torque_q15 * (1 << 14);
    s->at_limit = false;
    s->torque_is_slow = false;
    for (uint32_t n = 0; n < PARAM_TORQUE_MEAN_MOST_MS - 1; n++) {
        s->before_q15[n] = torque_q15;
    }
}

int32_t speed_loop_before_q29(const struct speed_loop *s, bool answered_backwards)
{
    const int32_t growth_q29 = speed_loop_answer_q29(s, (s->ref_rpm_q16 >> 1) - s->estimate.travel_q15, s->ki_q16);
    const bool grew = !s->at_limit || (growth_q29 > 0) == answered_backwards;
    return grew ? s->integral_q29 - growth_q29 : s->integral_q29;
}

int32_t speed_loop_lead(struct speed_loop *s, int32_t slope_q16)
{
    s->ref_rpm_q16 += speed_loop_towards(s->target_rpm_q16, s->ref_rpm_q16, slope_q16);
    s->speed_ref_rpm_q4 = s->ref_rpm_q16 >> 12;
    s->at_limit = false;
    return s->ref_rpm_q16;
}

/*
 * While no edge comes, an integral that stops growing would leave the shaft stuck: with a speed reference, one count of lag
 * still weighs a hundredth of the largest current. At rest it weighs nothing: no hunting for a count.
 */
int32_t speed_loop_memory_q16(const struct speed_loop *s, const struct tuning *t, int32_t share_q14)
{
    const int32_t scaled_q16 = (int32_t)(((int64_t)s->ki_q16 * (share_q14 * share_q14)) >> 28);
    return s->ref_rpm_q16 != 0 ? q15_max(scaled_q16, q15_min(t->speed_ki_min_q16, s->ki_q16)) : scaled_q16;
}

/*
 * Repeated swings of a quarter of the largest current, each within HUNT_MS: the shaft is lighter than the gains assume, or
 * oscillates against its load. Reduces the gains by a quarter until it calms down.
 */
void speed_loop_count_swing(struct speed_loop *s)
{
    s->swings = s->swing_ms < HUNT_MS ? s->swings + 1u : 0u;
    s->swing_ms = 0;
    s->swing = -s->swing;
    if (s->swings >= HUNT_SWINGS && s->calmed < CALMEST) {
        s->calmed++;
        s->kp_q16 -= s->kp_q16 / 4;
        s->ki_q16 -= s->ki_q16 / 4;
    }
}

/*
 * The mean of the last demands. A coupling oscillates at some hundred hertz, where the load's inertia does not count and the
 * loop's delay makes damping negative: a mean over two steps removes 500 Hz, over three 333 Hz, and most of the frequencies
 * around.
 */
int32_t speed_loop_mean_q15(struct speed_loop *s, int32_t mean_ms, int32_t wish_q15)
{
    int32_t sum_q15 = wish_q15;
    int32_t later_q15 = wish_q15;
    for (int32_t n = 0; n < mean_ms - 1; n++) {
        const int32_t wished_q15 = s->before_q15[n];
        s->before_q15[n] = later_q15;
        sum_q15 += wished_q15;
        later_q15 = wished_q15;
    }
    return sum_q15 / mean_ms;
}

int32_t speed_loop_step(struct speed_loop *s, const struct tuning *t, int32_t slope_q16, const struct interval *limits)
{
    return speed_loop_ramp_step(s, t, slope_q16, limits);
}

int32_t speed_loop_follow(struct speed_loop *s, const struct tuning *t, int32_t ref_rpm_q16, int32_t moved_q16,
                          const struct interval *limits)
{
    s->ref_rpm_q16 = ref_rpm_q16;
    s->target_rpm_q16 = ref_rpm_q16;
    s->speed_ref_rpm_q4 = ref_rpm_q16 >> 12;
    return speed_loop_control(s, t, moved_q16, limits);
}
