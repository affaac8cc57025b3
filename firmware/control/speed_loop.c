/* SPDX-License-Identifier: MIT */
#include "firmware/control/speed_loop.h"

#include "firmware/settings/scale.h"
#include "lib/q15.h"

#define ONE_Q29          (1 << 29)
#define ALL_Q15          32768
#define HUNT_MS          32u
#define HUNT_SWINGS      4u
#define REDUCTIONS_MOST  10u /* quarters: a sixteenth of the gains is left */
#define COURSE_SHIFT     3   /* of a reference's step that its course takes at once, */
#define BEND_SHIFT       7   /* and that bends it: 14 Hz, damped by 0.7 */
#define SLOW_SHIFT       2   /* of the bandwidth, if torque is slow: kp scales with it, ki with its square */
#define ERROR_TIMES_GAIN ((1LL << 43) - 1) /* 2.0 in Q29, before the shift of answer_q29() */

/* The step from `here` to `target`, `most` at most; the distance may take 32 bits and a sign. */
static int32_t towards(int32_t target, int32_t here, int32_t most)
{
    const uint32_t distance = (uint32_t)target - (uint32_t)here;
    if (target >= here) {
        return distance < (uint32_t)most ? (int32_t)distance : most;
    }
    return -distance < (uint32_t)most ? (int32_t)distance : -most;
}

/* Large gain, small error; the product has 13 bits too many. */
static int32_t answer_q29(const struct speed_loop *s, int32_t error_q15, int32_t gain_q16)
{
    return (int32_t)(((int64_t)q15_clamp(error_q15, -s->error_max_q15, s->error_max_q15) * gain_q16) >> 13);
}

void speed_loop_measure(struct speed_loop *s, const struct encoder_regs *encoder, const struct tuning *t)
{
    speed_estimate_step(&s->estimate, encoder, t);
    s->estimated = false;
    s->speed_rpm_q4 = s->estimate.speed_rpm_q15 >> 11;
}

void speed_loop_take(struct speed_loop *s, int32_t speed_rpm_q15, int32_t travel_q15, uint32_t clocks)
{
    speed_estimate_take(&s->estimate, speed_rpm_q15, travel_q15, clocks);
    oscillation_reset(&s->oscillation);
    s->estimated = true;
    s->speed_rpm_q4 = speed_rpm_q15 >> 11;
}

void speed_loop_init(struct speed_loop *s)
{
    *s = (struct speed_loop){.swing = 1, .accel_share_q15 = ALL_Q15};
    oscillation_init(&s->oscillation);
    speed_estimate_reset(&s->estimate);
}

void speed_loop_soften(struct speed_loop *s, int32_t kp_q16, int32_t ki_q16)
{
    s->kp_q16 = kp_q16;
    s->ki_q16 = ki_q16;
    s->error_max_q15 = scale_clamp(ERROR_TIMES_GAIN / kp_q16, 0, INT32_MAX);
}

void speed_loop_allow_less(struct speed_loop *s, bool allowed)
{
    s->oscillation.only_counts = !allowed;
}

void speed_loop_tune(struct speed_loop *s, const struct tuning *t)
{
    speed_loop_soften(s, t->speed_kp_q16, t->speed_ki_q16);
    s->accel_share_q15 = ALL_Q15;
    oscillation_init(&s->oscillation);
    s->notch.on = false;
    s->reductions = 0;
    s->swings = 0;
}

void speed_loop_reset(struct speed_loop *s, int32_t torque_q15)
{
    s->ref_rpm_q16 = s->estimate.speed_rpm_q15 * 2;
    s->target_rpm_q16 = s->ref_rpm_q16;
    s->course_rpm_q15 = s->ref_rpm_q16 >> 1;
    s->course_step_q15 = 0;
    s->speed_ref_rpm_q4 = s->speed_rpm_q4;
    s->integral_q29 = torque_q15 * (1 << 14);
    s->at_limit = false;
    s->torque_is_slow = false;
    oscillation_reset(&s->oscillation);
    notch_reset(&s->notch, s->integral_q29);
    for (uint32_t n = 0; n < PARAM_TORQUE_MEAN_MOST_MS - 1; n++) {
        s->before_q15[n] = torque_q15;
    }
}

int32_t speed_loop_before_q29(const struct speed_loop *s, bool answered_backwards)
{
    const int32_t growth_q29 = answer_q29(s, (s->ref_rpm_q16 >> 1) - s->estimate.travel_q15, s->ki_q16);
    const bool grew = !s->at_limit || (growth_q29 > 0) == answered_backwards;
    return grew ? scale_clamp((int64_t)s->integral_q29 - growth_q29, -2 * ONE_Q29, 2 * ONE_Q29 - 1) : s->integral_q29;
}

int32_t speed_loop_lead(struct speed_loop *s, int32_t slope_q16)
{
    s->ref_rpm_q16 += towards(s->target_rpm_q16, s->ref_rpm_q16, slope_q16);
    s->speed_ref_rpm_q4 = s->ref_rpm_q16 >> 12;
    s->at_limit = false;
    return s->ref_rpm_q16;
}

/*
 * While no edge comes, an integral that stops growing would leave the shaft stuck: with a speed reference, one count of lag
 * still weighs a hundredth of the largest current. At rest it weighs nothing: no hunting for a count.
 */
static int32_t memory_q16(const struct speed_loop *s, const struct tuning *t, int32_t share_q14)
{
    const int32_t scaled_q16 = (int32_t)(((int64_t)s->ki_q16 * (share_q14 * share_q14)) >> 28);
    return s->ref_rpm_q16 != 0 ? q15_max(scaled_q16, q15_min(t->speed_ki_min_q16, s->ki_q16)) : scaled_q16;
}

static int32_t share_of(int32_t gain, int32_t share_q15)
{
    return (int32_t)(((int64_t)gain * share_q15) >> 15);
}

/* The memory takes the share twice: the loop is slower and keeps its damping. A light shaft needs less to accelerate, too. */
static void take_less(struct speed_loop *s)
{
    const int32_t share_q15 = s->oscillation.share_q15;
    speed_loop_soften(s, q15_max(share_of(s->kp_q16, share_q15), 1),
                      share_of(share_of(s->ki_q16, share_q15), share_q15));
    if (s->oscillation.light) {
        s->accel_share_q15 = share_of(s->accel_share_q15, share_q15);
    }
}

/*
 * The mean of the last demands. A coupling oscillates at some hundred hertz, where the load's inertia does not count and the
 * loop's delay makes damping negative: a mean over two steps removes 500 Hz, over three 333 Hz, and most of the frequencies
 * around.
 */
static int32_t mean_demand_q15(struct speed_loop *s, int32_t mean_ms, int32_t demand_q15)
{
    int32_t sum_q15 = demand_q15;
    int32_t later_q15 = demand_q15;
    for (int32_t n = 0; n < mean_ms - 1; n++) {
        const int32_t earlier_q15 = s->before_q15[n];
        s->before_q15[n] = later_q15;
        sum_q15 += earlier_q15;
        later_q15 = earlier_q15;
    }
    return sum_q15 / mean_ms;
}

/* Follows the reference, behind no steady ramp, and through its waits. */
static void keep_course(struct speed_loop *s)
{
    const int32_t left_q15 = (s->ref_rpm_q16 >> 1) - s->course_rpm_q15;
    s->course_step_q15 += left_q15 >> BEND_SHIFT;
    s->course_rpm_q15 += s->course_step_q15 + (left_q15 >> COURSE_SHIFT);
}

/*
 * Moves the reference towards the command and returns the wanted step, in rpm Q16. While the current is at its limit and the
 * rotor lags, the reference waits; the feed-forward keeps asking for full torque.
 */
static int32_t ramp(struct speed_loop *s, int32_t slope_q16)
{
    const int32_t step = towards(s->target_rpm_q16, s->ref_rpm_q16, slope_q16);
    const int32_t ahead_q4 = s->speed_ref_rpm_q4 - s->speed_rpm_q4;
    if (!s->at_limit || (step > 0 ? ahead_q4 <= 0 : ahead_q4 >= 0)) {
        s->ref_rpm_q16 += step;
    }
    s->speed_ref_rpm_q4 = s->ref_rpm_q16 >> 12;
    keep_course(s);
    return step;
}

/* At most +-1.0: the product's upper word shows which. */
static int32_t feedforward_q29(const struct speed_loop *s, const struct tuning *t, int32_t moved_q16)
{
    const int64_t wanted_q39 = (int64_t)t->speed_accel_q8 * moved_q16;
    const int32_t high_q7 = (int32_t)(wanted_q39 >> 32);
    const int32_t all_q29 =
        high_q7 >= 1 << 7 ? ONE_Q29 : (high_q7 < -(1 << 7) ? -ONE_Q29 : (int32_t)(wanted_q39 >> 10));
    return share_of(all_q29, s->accel_share_q15);
}

/*
 * What swings has swung the integral, too: it becomes the mean of the demand. While the loop has let go of the shaft, that is
 * all, feed-forward included.
 */
static void follow_oscillation(struct speed_loop *s, const struct tuning *t, enum oscillation_verdict verdict,
                               int32_t moved_q16)
{
    if (verdict == OSCILLATION_NOTHING) {
        return;
    }
    s->integral_q29 = s->oscillation.mean_q15 * (1 << 14);
    if (verdict == OSCILLATION_LET_GO) {
        return;
    }
    take_less(s);
    if (verdict == OSCILLATION_NOTCH) {
        notch_set(&s->notch, s->oscillation.ring_c_q13, s->integral_q29);
    }
    s->integral_q29 -= feedforward_q29(s, t, moved_q16);
}

/*
 * An estimate, of Hall switches or the observer, swings by itself, most where one source follows another, and is no tone.
 * Repeated swings of a quarter of the largest current, each within HUNT_MS, reduce the gains by a quarter until it calms down.
 */
static void calm_estimate(struct speed_loop *s, int32_t answer_q12, int32_t i_max_q12)
{
    s->swing_ms++;
    if (answer_q12 * s->swing <= i_max_q12 / 4) {
        return;
    }
    s->swings = s->swing_ms < HUNT_MS ? s->swings + 1u : 0u;
    s->swing_ms = 0;
    s->swing = -s->swing;
    if (s->swings >= HUNT_SWINGS && s->reductions < REDUCTIONS_MOST) {
        s->reductions++;
        s->kp_q16 -= s->kp_q16 / 4;
        s->ki_q16 -= s->ki_q16 / 4;
    }
}

/* Shares of an error that count while edges are rare, or torque is slow. */
static int32_t weighed_q15(const struct speed_loop *s, int32_t error_q15, int32_t share_q14)
{
    const int32_t shared_q15 = share_q14 == 1 << 14 ? error_q15 : (int32_t)(((int64_t)error_q15 * share_q14) >> 14);
    return s->torque_is_slow ? shared_q15 >> SLOW_SHIFT : shared_q15;
}

static int32_t in_q12(const struct speed_loop *s, int32_t error_q15, uint32_t shift)
{
    return scale_clamp(((int64_t)error_q15 * s->kp_q16) >> shift, -INT16_MAX, INT16_MAX);
}

/*
 * The loop's own swing is looked for, not that of a ramp, which waits and goes on while the torque is at its limit: the speed
 * is compared with the reference's course.
 */
static void watch_oscillation(struct speed_loop *s, const struct tuning *t, int32_t share_q14, int32_t moved_q16)
{
    const int32_t off_q15 = weighed_q15(s, s->course_rpm_q15 - s->estimate.speed_rpm_q15, share_q14);
    s->oscillation.edge_q12 = in_q12(s, t->travel_per_count_q12 >> 5, 30);
    if ((moved_q16 < 0 && s->moved_q16 > 0) || (moved_q16 > 0 && s->moved_q16 < 0)) {
        oscillation_reset(&s->oscillation);
    }
    s->moved_q16 = moved_q16 != 0 ? moved_q16 : s->moved_q16;
    const uint32_t shift = s->oscillation.listens ? 30u + OSCILLATION_LISTEN_SHIFT : 30u;
    const int32_t seen_q12 = in_q12(s, off_q15, shift);
    follow_oscillation(s, t, oscillation_step(&s->oscillation, seen_q12, s->demand_q15, t->i_max_q15), moved_q16);
}

/*
 * Proportional part, integral and feed-forward; or the integral alone while the loop has let go. Of the range, in this order,
 * up to 2.0, 2.0 (it was handed over, or is a mean without the feed-forward of a ramp that now turns) and 1.0: their sum can
 * be beyond 32 bits, where it would ask for the other direction.
 */
static int32_t wanted_of(struct speed_loop *s, const struct tuning *t, int32_t error_q15, int32_t moved_q16)
{
    int32_t wanted_q29 = s->integral_q29;
    if (!s->oscillation.listens) {
        const int32_t now_q29 =
            answer_q29(s, error_q15, s->kp_q16) + (moved_q16 != 0 ? feedforward_q29(s, t, moved_q16) : 0);
        wanted_q29 += q15_clamp(now_q29, INT32_MIN - q15_min(wanted_q29, 0), INT32_MAX - q15_max(wanted_q29, 0));
    }
    return s->notch.on ? notch_step(&s->notch, wanted_q29) : wanted_q29;
}

/* In Q29 a torque has 14 bits beyond Q15. */
static int32_t control(struct speed_loop *s, const struct tuning *t, int32_t moved_q16, const struct interval *limits)
{
    const int32_t ref_rpm_q15 = s->ref_rpm_q16 >> 1;
    const int32_t low_q29 = limits->low * (1 << 14);
    const int32_t high_q29 = limits->high * (1 << 14);
    const bool rare = s->estimate.interval_clocks > SPEED_LOOP_FULL_GAIN_CLOCKS;
    const int32_t share_q14 = rare ? speed_loop_share_q14(&s->estimate) : 1 << 14;
    const int32_t error_q15 = weighed_q15(s, ref_rpm_q15 - s->estimate.speed_rpm_q15, share_q14);
    const int32_t memory = rare ? memory_q16(s, t, share_q14) : s->ki_q16;
    const int32_t ki_q16 = s->torque_is_slow ? memory >> 2 * SLOW_SHIFT : memory;
    if (s->estimated) {
        calm_estimate(s, in_q12(s, error_q15, 30), t->i_max_q15 >> 3);
    } else {
        watch_oscillation(s, t, share_q14, moved_q16);
    }
    const int32_t wanted_q29 = wanted_of(s, t, error_q15, moved_q16);
    s->at_limit = wanted_q29 < low_q29 || wanted_q29 > high_q29;
    s->demand_q15 = q15_clamp(wanted_q29, low_q29, high_q29) >> 14;
    /* integrate unless that would push further into the limit */
    const int32_t growth_q29 = answer_q29(s, ref_rpm_q15 - s->estimate.travel_q15, ki_q16);
    if (!s->oscillation.listens && (!s->at_limit || (growth_q29 > 0) != (wanted_q29 > 0))) {
        s->integral_q29 = q15_clamp(s->integral_q29 + growth_q29, low_q29, high_q29);
    }
    return t->torque_mean_ms > 1 ? mean_demand_q15(s, t->torque_mean_ms, wanted_q29 >> 14) : wanted_q29 >> 14;
}

int32_t speed_loop_step(struct speed_loop *s, const struct tuning *t, int32_t slope_q16, const struct interval *limits)
{
    return control(s, t, ramp(s, slope_q16), limits);
}

int32_t speed_loop_follow(struct speed_loop *s, const struct tuning *t, int32_t ref_rpm_q16, int32_t moved_q16,
                          const struct interval *limits)
{
    s->ref_rpm_q16 = ref_rpm_q16;
    s->target_rpm_q16 = ref_rpm_q16;
    s->speed_ref_rpm_q4 = ref_rpm_q16 >> 12;
    s->course_rpm_q15 = ref_rpm_q16 >> 1; /* whoever moves it does not wait */
    s->course_step_q15 = 0;
    return control(s, t, moved_q16, limits);
}
