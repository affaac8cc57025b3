/* SPDX-License-Identifier: MIT */
#include "firmware/control/speed_loop.h"

#include "lib/limit.h"

#define ONE_Q14          (1 << 14)
#define FULL_GAIN_CLOCKS 150000u /* 1.5 ms: while an edge comes in every step, or nearly */
#define HUNT_MS          32u
#define HUNT_SWINGS      4u
#define CALMEST_Q14      (ONE_Q14 / 16)

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
    *s = (struct speed_loop){.calm_q14 = ONE_Q14};
    speed_estimate_reset(&s->estimate);
}

void speed_loop_full_gains(struct speed_loop *s)
{
    s->calm_q14 = ONE_Q14;
    s->swings = 0;
}

void speed_loop_reset(struct speed_loop *s, int32_t i_q_ref_q15)
{
    s->ref_rpm_q16 = s->estimate.speed_rpm_q15 * 2;
    s->target_rpm_q16 = s->ref_rpm_q16;
    s->speed_ref_rpm_q4 = s->speed_rpm_q4;
    s->integral_q16 = (int64_t)i_q_ref_q15 * 65536;
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

int32_t speed_loop_current_limit(const volatile struct current_loop *c, const struct tuning *t)
{
    const int32_t w_q15 = q15_abs(current_loop_w_q15(c));
    const int32_t emf_q15 = (w_q15 * t->emf_q12) >> 12;
    const int32_t x_q15 = (w_q15 * t->x_q_q11) >> 11;
    const int32_t usable_q15 = c->radius_q15 * 19 / 20;
    const int32_t rest_q15 = circle_rest_q15(q15_min(emf_q15, usable_q15), usable_q15);
    const int32_t limit_q15 = x_q15 > 0 ? (int32_t)((uint32_t)rest_q15 * 32768u / (uint32_t)x_q15) : t->i_max_q15;
    return q15_min(limit_q15, t->i_max_q15);
}

/*
 * The share of the gains that the time between two edges leaves: a loop may not answer faster than it is told. The answer to
 * an error takes its share once, the memory of it twice: the loop becomes slower as a whole, and keeps its damping.
 */
static int32_t share_q14(const struct speed_estimate *e)
{
    return e->interval_clocks > FULL_GAIN_CLOCKS ? (int32_t)((FULL_GAIN_CLOCKS << 14) / e->interval_clocks) : ONE_Q14;
}

/*
 * While no edge comes a memory that forgets how to grow would leave the shaft stuck for ever: if it is to turn, so much is
 * left that a count behind weighs a hundredth of the largest current. At rest nothing is: it does not hunt for a count.
 */
static int32_t memory_q16(const struct speed_loop *s, const struct tuning *t, int32_t share_q14)
{
    if (share_q14 == ONE_Q14) {
        return t->speed_ki_q16;
    }
    const int32_t scaled_q16 = (int32_t)(((int64_t)t->speed_ki_q16 * (share_q14 * share_q14)) >> 28);
    return s->ref_rpm_q16 != 0 ? q15_max(scaled_q16, t->speed_ki_min_q16) : scaled_q16;
}

/*
 * A quarter of the largest current one way and the other, again and again, each time within HUNT_MS: the shaft is lighter than
 * the gains are for, or swings against its load. Then a quarter of the gains goes, until it calms down.
 */
static void watch_hunting(struct speed_loop *s, int32_t answer_q15, int32_t i_max_q15)
{
    s->swing_ms += s->swing_ms < HUNT_MS;
    if (q15_abs(answer_q15) <= i_max_q15 / 4 || (answer_q15 < 0) == s->swing_negative) {
        return;
    }
    s->swings = s->swing_ms < HUNT_MS ? s->swings + 1u : 0u;
    s->swing_negative = answer_q15 < 0;
    s->swing_ms = 0;
    if (s->swings >= HUNT_SWINGS && s->calm_q14 > CALMEST_Q14) {
        s->calm_q14 -= s->calm_q14 / 4;
    }
}

int32_t speed_loop_step(struct speed_loop *s, const struct tuning *t, int32_t slope_q16, int32_t limit_q15)
{
    const int32_t moved_q16 = ramp(s, slope_q16);
    const int32_t share = share_q14(&s->estimate);
    const int64_t limit_q16 = (int64_t)limit_q15 * 65536;
    const int32_t error_q15 = (s->ref_rpm_q16 >> 1) - s->estimate.speed_rpm_q15;
    const int32_t behind_q15 = (s->ref_rpm_q16 >> 1) - s->estimate.travel_q15;
    const int32_t kp_q16 = (int32_t)(((int64_t)t->speed_kp_q16 * s->calm_q14) >> 14);
    const int32_t ki_q16 = (int32_t)(((int64_t)memory_q16(s, t, share) * s->calm_q14) >> 14);
    const int64_t answer_q16 = (((int64_t)error_q15 * share >> 14) * kp_q16) >> 11;
    const int64_t feedforward_q16 = ((int64_t)t->speed_accel_q8 * moved_q16) >> 8;
    const int64_t wanted_q16 = answer_q16 + feedforward_q16 + s->integral_q16;
    const int64_t output_q16 = clamp(wanted_q16, -limit_q16, limit_q16);
    watch_hunting(s, (int32_t)(clamp(answer_q16, -limit_q16, limit_q16) >> 16), t->i_max_q15);
    s->at_limit = output_q16 != wanted_q16;
    /* integrate unless that would push further into the limit */
    const int64_t growth_q16 = ((int64_t)behind_q15 * ki_q16) >> 11;
    if (!s->at_limit || (growth_q16 > 0) != (wanted_q16 > 0)) {
        s->integral_q16 = clamp(s->integral_q16 + growth_q16, -limit_q16, limit_q16);
    }
    return (int32_t)(output_q16 >> 16);
}
