/* SPDX-License-Identifier: MIT */
#include "firmware/control/speed_loop.h"

#define FULL_GAIN_CLOCKS 150000u /* 1.5 ms: while an edge comes in every step, or nearly */
#define HUNT_MS          32u
#define HUNT_SWINGS      4u
#define CALMEST          10u /* quarters: of the gains a sixteenth is left */

/* A current beside which any other is small; of three the sum fits. */
static int32_t limited(int64_t x)
{
    return x > INT32_MAX ? INT32_MAX : (x < -INT32_MAX ? -INT32_MAX : (int32_t)x);
}

static int64_t clamp(int64_t x, int64_t low, int64_t high)
{
    return x < low ? low : (x > high ? high : x);
}

void speed_loop_measure(struct speed_loop *s, const struct encoder_regs *encoder, const struct tuning *t)
{
    speed_estimate_step(&s->estimate, encoder, t);
    s->speed_rpm_q4 = s->estimate.speed_rpm_q15 >> 11;
}

void speed_loop_init(struct speed_loop *s)
{
    *s = (struct speed_loop){.swing = 1};
    speed_estimate_reset(&s->estimate);
}

void speed_loop_tune(struct speed_loop *s, const struct tuning *t)
{
    s->kp_q16 = t->speed_kp_q16;
    s->ki_q16 = t->speed_ki_q16;
    s->calmed = 0;
    s->swings = 0;
}

void speed_loop_reset(struct speed_loop *s, int32_t torque_q15)
{
    s->ref_rpm_q16 = s->estimate.speed_rpm_q15 * 2;
    s->target_rpm_q16 = s->ref_rpm_q16;
    s->speed_ref_rpm_q4 = s->speed_rpm_q4;
    s->integral_q16 = torque_q15 * 65536;
    s->at_limit = false;
}

/*
 * Moves the reference towards the command and returns the step that it wants, in rpm Q16. While the current is at its limit and
 * the rotor behind, the reference waits for it; the feed-forward goes on asking for all there is.
 */
static int32_t ramp(struct speed_loop *s, int32_t slope_q16)
{
    const int64_t distance = (int64_t)s->target_rpm_q16 - s->ref_rpm_q16;
    const int32_t step = (int32_t)clamp(distance, -slope_q16, slope_q16);
    const int32_t ahead_q4 = s->speed_ref_rpm_q4 - s->speed_rpm_q4;
    if (!s->at_limit || (step > 0 ? ahead_q4 <= 0 : ahead_q4 >= 0)) {
        s->ref_rpm_q16 += step;
    }
    s->speed_ref_rpm_q4 = s->ref_rpm_q16 >> 12;
    return step;
}

/*
 * The share of the gains that the time between two edges leaves: a loop may not answer faster than it is told. The answer to
 * an error takes its share once, the memory of it twice: the loop becomes slower as a whole, and keeps its damping.
 */
static int32_t share_q14(const struct speed_estimate *e)
{
    return (int32_t)((FULL_GAIN_CLOCKS << 14) / e->interval_clocks);
}

/*
 * While no edge comes a memory that forgets how to grow would leave the shaft stuck for ever: if it is to turn, so much is
 * left that a count behind weighs a hundredth of the largest current. At rest nothing is: it does not hunt for a count.
 */
static int32_t memory_q16(const struct speed_loop *s, const struct tuning *t, int32_t share_q14)
{
    const int32_t scaled_q16 = (int32_t)(((int64_t)s->ki_q16 * (share_q14 * share_q14)) >> 28);
    return s->ref_rpm_q16 != 0 ? q15_max(scaled_q16, q15_min(t->speed_ki_min_q16, s->ki_q16)) : scaled_q16;
}

/*
 * A quarter of the largest current one way and the other, again and again, each time within HUNT_MS: the shaft is lighter than
 * the gains are for, or swings against its load. Then a quarter of the gains goes, until it calms down.
 */
static void count_swing(struct speed_loop *s)
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

int32_t speed_loop_step(struct speed_loop *s, const struct tuning *t, int32_t slope_q16, const struct interval *limits)
{
    const int32_t moved_q16 = ramp(s, slope_q16);
    const int32_t ref_rpm_q15 = s->ref_rpm_q16 >> 1;
    int32_t error_q15 = ref_rpm_q15 - s->estimate.speed_rpm_q15;
    int32_t ki_q16 = s->ki_q16;
    if (s->estimate.interval_clocks > FULL_GAIN_CLOCKS) {
        const int32_t share = share_q14(&s->estimate);
        ki_q16 = memory_q16(s, t, share);
        error_q15 = (int32_t)(((int64_t)error_q15 * share) >> 14);
    }
    const int32_t answer_q16 = limited(((int64_t)error_q15 * s->kp_q16) >> 11);
    const int32_t growth_q16 = limited(((int64_t)(ref_rpm_q15 - s->estimate.travel_q15) * ki_q16) >> 11);
    const int32_t feedforward_q16 = limited(((int64_t)t->speed_accel_q8 * moved_q16) >> 8);
    const int32_t low_q16 = limits->low * 65536;
    const int32_t high_q16 = limits->high * 65536;
    const int64_t wanted_q16 = (int64_t)answer_q16 + feedforward_q16 + s->integral_q16;
    s->swing_ms++;
    if (answer_q16 / 65536 * s->swing > t->i_max_q15 / 4) {
        count_swing(s);
    }
    s->at_limit = wanted_q16 < low_q16 || wanted_q16 > high_q16;
    /* integrate unless that would push further into the limit */
    if (!s->at_limit || (growth_q16 > 0) != (wanted_q16 > 0)) {
        s->integral_q16 = (int32_t)clamp((int64_t)s->integral_q16 + growth_q16, low_q16, high_q16);
    }
    return (int32_t)(clamp(wanted_q16, INT32_MIN, INT32_MAX) >> 16);
}
