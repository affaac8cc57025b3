/* SPDX-License-Identifier: MIT */
#include "firmware/commission/alignment.h"

#include <stddef.h>

#include "firmware/commission/alignment_parts.h"
#include "firmware/commission/measure.h"
#include "firmware/settings/config.h"
#include "lib/angle.h"
#include "lib/q15.h"
#include "lib/trig.h"

/* ==== the magnets' axis ==== */

/*
 * The magnets' axis, measured at rest without a holding current. If reluctance outweighs the magnets this is done before the
 * rotor is pulled, and again after it has turned; in other salient machines only after it has turned.
 */

/* ==== saliency ==== */

#define STEP_Q32 (0x80000000u / SALIENCY_ANGLES)

/*
 * The voltage of each millisecond, in halves, and the weight of the current sampled at its beginning: the sum is the response
 * to whole waves. A constant drift, from an offset or a turning rotor, cancels. Each angle leaves a small current, because dead
 * time acts at both ends of the pattern; the next one starts with the opposite sign and removes it.
 */
static const int32_t HALVES[] = {1, -2, 2, -2, 2, -1};
static const int32_t WEIGHTS[] = {0, 1, -2, 2, -2, 1};
#define PATTERN_MS (sizeof HALVES / sizeof HALVES[0])

void saliency_start(struct saliency *s, int32_t v_q15, int32_t i_q15)
{
    *s = (struct saliency){.v_q15 = v_q15, .i_q15 = q15_max(i_q15, 1)};
}

static int32_t steps(const volatile struct current_loop *c, int32_t v_q15)
{
    return q15_clamp(measure_steps(c, v_q15), -LOOP_V_D_MAX_STEPS / 2, LOOP_V_D_MAX_STEPS / 2);
}

/*
 * A residual current, from an oscillating rotor or dead time, would distort the response of saturated iron. A constant voltage
 * removes it during this pattern: fully along d, partly along q, where the inductance is larger.
 */
static void take_away(struct saliency *s, const volatile struct current_loop *c)
{
    const cossin_t step = cossin_q15(s->angle == 0u ? 0u : STEP_Q32);
    const int32_t d_q15 = (c->i_d_q15 * step.cos + c->i_q_q15 * step.sin) >> 15;
    const int32_t q_q15 = (c->i_q_q15 * step.cos - c->i_d_q15 * step.sin) >> 15;
    s->steady_d_q15 = -d_q15 * (s->v_q15 / (int32_t)PATTERN_MS) / s->i_q15;
    s->steady_q_q15 = -q_q15 * (s->v_q15 / (int32_t)PATTERN_MS) / s->i_q15;
}

bool saliency_step(struct saliency *s, volatile struct current_loop *c, uint32_t encoder_q32)
{
    if (s->angle == SALIENCY_ANGLES) {
        current_loop_hold(c, 0, 0);
        return true;
    }
    const uint32_t angle_q32 = s->angle * STEP_Q32;
    const int32_t sign = (s->angle & 1u) == 0u ? 1 : -1;
    const int32_t v_q15 = sign * HALVES[s->ms] * s->v_q15 / 2;
    if (s->ms == 0u) {
        take_away(s, c);
    }
    measure_axes_add(&s->sums, angle_q32 - encoder_q32, sign * WEIGHTS[s->ms] * c->i_d_q15,
                     sign * WEIGHTS[s->ms] * c->i_q_q15);
    measure_hold_voltage(c, angle_q32, steps(c, s->steady_d_q15 + v_q15), steps(c, s->steady_q_q15));
    s->ms = (s->ms + 1u) % PATTERN_MS;
    s->angle += s->ms == 0u ? 1u : 0u;
    return false;
}

uint32_t saliency_offset_q32(const struct saliency *s)
{
    return measure_axes_angle_q32(&s->sums);
}

bool saliency_seen(const struct saliency *s)
{
    const struct measure_shares m = measure_axes_shares(&s->sums);
    return q15_max(q15_abs(m.re), q15_abs(m.im)) > m.straight / 10;
}

#define STILL_MS       12u
#define STILL_MAX_MS   2000u
#define STOOD_PART     72 /* of a turn: 5 degrees */
#define AXIS_APART_Q32 (DEGREES_45_Q32 / 9 * 2)
#define NORTH_Q32      (DEGREES_45_Q32 / 9 * 16) /* 80 degrees */
#define FRICTION_Q32   (DEGREES_45_Q32 / 45 * 6) /* in addition, where friction holds the rotor back */

/*
 * The magnets' axis is known, but not its polarity: a field across it is never opposite to the rotor's rest position, so the
 * rotor oscillates by less than 90 degrees.
 */
static void pull_across(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    a->first_offset_q32 = saliency_offset_q32(&a->axis);
    a->field_q32 = angle_q32 + a->first_offset_q32 + QUARTER_Q32;
    pendulum_start(&a->rotor, t->align[a->level].period_ms, angle_q32, a->field_q32);
    a->target_q15 =
        /* reluctance still outweighs the magnets, and the rotor oscillates more slowly */
        t->align[a->level].i_q15 / 3 * 2;
    a->origin = a->counts;
    alignment_enter(a, STAGE_PULL);
}

static enum alignment_result step_drop(struct alignment *a, volatile struct current_loop *c, const struct tuning *t)
{
    current_loop_set_i_d(c, 0);
    current_loop_field(c, a->field_q32, 0);
    if (a->still_ms >= STILL_MS) {
        saliency_start(&a->axis, t->saliency_v_q15, t->saliency_i_q15);
        a->stood_at = a->counts;
        a->stood = true;
        alignment_enter(a, STAGE_AXIS);
    } else if (a->stage_ms > STILL_MAX_MS) {
        a->detail[0] = ALIGNMENT_OUT_DEGREES;
        return ALIGNMENT_LOAD;
    }
    return ALIGNMENT_RUNNING;
}

/* The difference of two offsets that are ambiguous by half a turn. */
static int32_t apart_q32(uint32_t x_q32, uint32_t y_q32)
{
    return q15_abs((int32_t)(2u * (x_q32 - y_q32)) / 2);
}

/* The end of the axis that is closer to `angle_q32`. */
static uint32_t nearer_end_q32(uint32_t offset_q32, uint32_t angle_q32)
{
    const bool near = angle_size_q32((int32_t)(angle_q32 - offset_q32)) <= QUARTER_Q32;
    return near ? offset_q32 : offset_q32 + 2u * QUARTER_Q32;
}

/*
 * The rotor followed the field with its north pole within `max_q32` of it, which is less than a quarter turn: that gives the
 * polarity. A load shifts it in one direction both times; friction, which may be larger, does not shift the mean.
 */
static enum alignment_result judge_north(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                         uint32_t angle_q32, uint32_t offset_q32, uint32_t max_q32)
{
    const int32_t forward_q32 = (int32_t)(a->load.forward_q32[0] - offset_q32);
    const int32_t back_q32 = (int32_t)(a->load.back_q32[0] - offset_q32);
    const uint32_t mean_q32 = angle_size_q32(forward_q32 / 2 + back_q32 / 2);
    const uint32_t away_q32 = mean_q32 + angle_size_q32(forward_q32 / 2 - back_q32 / 2);
    if (mean_q32 > max_q32 || away_q32 > max_q32 + FRICTION_Q32) {
        a->detail[0] = (int32_t)(away_q32 / (DEGREES_45_Q32 / 45));
        return alignment_again(a, t, angle_q32, ALIGNMENT_LOAD);
    }
    current_loop_offset(c, offset_q32);
    return ALIGNMENT_DONE;
}

/*
 * Reluctance held the rotor: close to 90 degrees the polarity is unknown. If the encoder does not count, the axis shows whether
 * the rotor has turned.
 */
static enum alignment_result judge_reluctant(struct alignment *a, volatile struct current_loop *c,
                                             const struct tuning *t, uint32_t angle_q32)
{
    const uint32_t offset_q32 = saliency_offset_q32(&a->axis);
    const bool apart = !saliency_seen(&a->axis) || apart_q32(offset_q32, a->first_offset_q32) > AXIS_APART_Q32;
    if (a->silent) {
        return alignment_again(a, t, angle_q32, apart ? ALIGNMENT_ENCODER_DEAD : ALIGNMENT_BLOCKED);
    }
    if (apart) {
        return alignment_again(a, t, angle_q32, ALIGNMENT_BLOCKED);
    }
    return judge_north(a, c, t, angle_q32, nearer_end_q32(offset_q32, a->load.back_q32[0]), NORTH_Q32);
}

/*
 * The magnets held the rotor: the axis, which no load shifts, replaces the offset from the passes. These remain if there is no
 * measurable saliency, or if a load turned the rotor during the measurement.
 */
static enum alignment_result judge_shown(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                         uint32_t angle_q32)
{
    if (a->stood && saliency_seen(&a->axis)) {
        const uint32_t offset_q32 = nearer_end_q32(saliency_offset_q32(&a->axis), a->load.centre_q32);
        return judge_north(a, c, t, angle_q32, offset_q32, DEGREES_45_Q32);
    }
    if (!load_is_identified(a, t)) {
        return alignment_again(a, t, angle_q32, ALIGNMENT_LOAD);
    }
    current_loop_offset(c, load_angle_offset_q32(&a->load));
    return ALIGNMENT_DONE;
}

enum alignment_result alignment_step_axis(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                          uint32_t angle_q32)
{
    if (a->stage == STAGE_DROP) {
        return step_drop(a, c, t);
    }
    a->stood = a->stood && q15_abs(a->counts - a->stood_at) * STOOD_PART <= t->encoder_counts / t->pole_pairs;
    if (!saliency_step(&a->axis, c, angle_q32)) {
        return ALIGNMENT_RUNNING;
    }
    if (a->turned) {
        return t->reluctant ? judge_reluctant(a, c, t, angle_q32) : judge_shown(a, c, t, angle_q32);
    }
    pull_across(a, t, angle_q32);
    return ALIGNMENT_RUNNING;
}

/* ==== pulling, and the stages ==== */

/*
 * The steps of alignment: the rotor is pulled to two angles of the field, turned (alignment_turns.c) and released; in most
 * salient machines the axis is then measured (above).
 */

#define JUMP_MS        8u /* for a quarter turn: quick, for a rotor at 180 degrees to the field */
#define SETTLE_PERIODS 10
#define SETTLE_MS      60
#define RATIO_MAX      32
#define GRIP_MS        5
#define BACK_PART      16 /* of a period: how long the current takes to return */
#define AWAY_TURNS     3  /* beyond this distance from the start a load drives the rotor */
#define TURNS_BACK     4  /* part of a period: the field may jump while the rotor moves away from it */

static uint32_t encoder_q32(const volatile struct current_loop *c, uint32_t latched)
{
    return latched * c->encoder_scale_q32;
}

void alignment_start(struct alignment *a, volatile struct current_loop *c, const struct tuning *t, uint32_t latched)
{
    *a = (struct alignment){.latched = latched, .field_q32 = 0u - QUARTER_Q32};
    alignment_begin_attempt(a, t, 0, encoder_q32(c, latched));
    current_loop_field(c, a->field_q32, 0);
}

/* ---- pulling ---- */

/* The current reaches its target within half a period; faster to hold a falling load. */
static void follow_current(struct alignment *a, const struct tuning *t)
{
    const int32_t half_ms = a->held_firmly || t->reluctant ? GRIP_MS : a->period_ms / 2;
    const int32_t slope_q15 = q15_max(t->align[a->level].i_q15 / half_ms, 1);
    a->current_q15 = measure_towards(a->current_q15, a->target_q15, slope_q15);
}

/* The rotor follows the field, and its oscillation is damped: it will not pass the opposite side again. */
static bool follows_field(const struct alignment *a)
{
    return a->stage == STAGE_SECOND && a->rotor.sense != 0;
}

/*
 * A reluctance machine is held where it is pulled across its magnets, and oscillates less. A rotor on the field may oscillate
 * on its coupling, which a current that follows the speed would excite: so the current returns slowly.
 */
static int32_t pull_current_q15(struct alignment *a, const struct tuning *t)
{
    if (a->held_firmly || t->reluctant) {
        return a->current_q15;
    }
    const int32_t more_q15 = a->current_q15 / q15_max(a->rotor.period_ms / BACK_PART, 1) + 1;
    const int32_t now_q15 = pull_speed_current_q15(&a->speed, t, a->current_q15);
    a->pull_q15 = follows_field(a) ? q15_min(now_q15, a->pull_q15 + more_q15) : now_q15;
    return a->pull_q15;
}

/* A rotor that accelerates without current is driven by its load: then the maximum current holds it. */
static void hold_load_firmly(struct alignment *a, const struct tuning *t)
{
    if (!t->reluctant && a->stage < STAGE_PASS && !a->held_firmly && pull_speed_falls(&a->speed, t)) {
        a->level = t->align_levels - 1u;
        a->target_q15 = t->align[a->level].i_q15;
        a->held_firmly = true;
        a->rotor.sense = 0; /* its position relative to the field is unknown now */
        alignment_begin_swing(a);
    }
}

/* During the pull the rotor turns half a turn to the field and a quarter with it, and oscillates; more is due to a load. */
bool alignment_check_external_drive(struct alignment *a, const struct tuning *t)
{
    const int32_t turns = a->stage < STAGE_PASS ? AWAY_TURNS : ALIGNMENT_TURNS;
    hold_load_firmly(a, t);
    return q15_abs(a->counts - a->origin) > turns * t->encoder_counts / t->pole_pairs;
}

/* Settled, or timed out: later without damping. */
static bool at_rest(const struct alignment *a)
{
    const int32_t max_ms = a->period_ms * SETTLE_PERIODS * (a->rotor.sense == 0 ? 2 : 1) + SETTLE_MS;
    return a->current_q15 == a->target_q15 && (pendulum_settled(&a->rotor) || (int32_t)a->stage_ms >= max_ms);
}

/*
 * Reluctance holds the rotor behind the field or ahead of it. If ahead, friction would pull it to the other side when the field
 * starts to turn; a quarter turn of the field does that beforehand.
 */
static bool leads_the_field(const struct alignment *a)
{
    return (a->counts - a->origin) * a->rotor.sense < 0;
}

static enum alignment_result step_first(struct alignment *a, const struct tuning *t)
{
    if (!at_rest(a)) {
        return ALIGNMENT_RUNNING;
    }
    if (t->reluctant && !leads_the_field(a)) {
        alignment_begin_pass(a, t, PASS_FORWARD);
    } else {
        a->jump_from = a->counts;
        alignment_enter(a, STAGE_SECOND);
    }
    return ALIGNMENT_RUNNING;
}

/*
 * If pole_pairs or encoder_counts is too large, the rotor appears to move more than a quarter turn: the field must then turn
 * slower, since the parameters scale the rotor's period. Friction has little influence.
 */
static void judge_jump(struct alignment *a, const struct tuning *t)
{
    const int32_t quarter = t->encoder_counts / t->pole_pairs / 4 + 1;
    const int32_t seen = q15_abs(a->counts - a->jump_from) * (int32_t)RATIO_ONE / quarter;
    a->ratio = (uint32_t)q15_clamp(seen, (int32_t)RATIO_ONE, RATIO_MAX);
}

/* A second attempt has more current. */
static enum alignment_result step_second(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    const uint32_t jump_ms = a->attempt == 0u ? JUMP_MS : (uint32_t)a->period_ms / 2u;
    if (a->stage_ms <= jump_ms) {
        a->field_q32 += QUARTER_Q32 / jump_ms;
        pull_speed_field_moves(&a->speed);
        pendulum_start(&a->rotor, a->rotor.period_ms, angle_q32, a->field_q32);
        alignment_begin_swing(a);
    } else if ((int32_t)(a->stage_ms - jump_ms) <= a->rotor.period_ms / TURNS_BACK) {
        alignment_begin_swing(a);
    } else if (at_rest(a)) {
        judge_jump(a, t);
        alignment_begin_pass(a, t, PASS_FORWARD);
    }
    return ALIGNMENT_RUNNING;
}

enum alignment_result alignment_step_pull(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    return a->stage == STAGE_PULL ? step_first(a, t) : step_second(a, t, angle_q32);
}

/* ---- sequence ---- */

/* The current is zero: from now on the offset does not change. */
static enum alignment_result step_release(struct alignment *a, volatile struct current_loop *c)
{
    if (a->current_q15 != 0) {
        return ALIGNMENT_RUNNING;
    }
    current_loop_set_currents(c, 0, 0);
    current_loop_offset(c, load_angle_offset_q32(&a->load));
    return ALIGNMENT_DONE;
}

static enum alignment_result step_stage(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                        uint32_t angle_q32)
{
    if (a->stage < STAGE_PASS) {
        return alignment_step_pull(a, t, angle_q32);
    }
    if (a->stage < STAGE_RELEASE) {
        return alignment_step_turns(a, c, t, angle_q32);
    }
    if (a->stage == STAGE_RELEASE) {
        return step_release(a, c);
    }
    return alignment_step_axis(a, c, t, angle_q32);
}

bool alignment_holds_voltage(const struct alignment *a)
{
    return a->stage == STAGE_AXIS;
}

enum alignment_result alignment_step(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                     uint32_t latched)
{
    const uint32_t angle_q32 = encoder_q32(c, latched);
    const int32_t moved = measure_counts(a->latched, latched, t->encoder_counts);
    a->latched = latched;
    a->counts += moved;
    a->stage_ms++;
    a->still_ms = moved == 0 ? a->still_ms + 1u : 0u;
    pull_speed_step(&a->speed, c, t, (int32_t)encoder_q32(c, (uint32_t)moved));
    alignment_observe_direction(a, c, t, moved, angle_q32);
    follow_current(a, t);
    if (alignment_check_external_drive(a, t)) {
        a->detail[0] = ALIGNMENT_OUT_DEGREES;
        return ALIGNMENT_LOAD;
    }
    if (a->stage < STAGE_DROP && a->stage != STAGE_PASS) {
        pendulum_step(&a->rotor, c, angle_q32, a->field_q32, 0, pull_current_q15(a, t));
    }
    return step_stage(a, c, t, angle_q32);
}

/* ==== speed limit of the pull ==== */

#define SHARE_BITS 8         /* of the current */
#define FADE       2         /* full current up to this part of the speed */
#define FALLS      2         /* times the speed */
#define STEADY     16        /* part of the current: if it changes by more, inductance takes the voltage */
#define ALONG_MS   2         /* one noisy sample does not count as braking */
#define LATE       2         /* times align_speed_ms: delay of the encoder's speed */
#define GAINS      2         /* a falling rotor gains this part of the allowed speed */
#define SURE       4         /* one that gains this part of it is not braked */
#define R_MARGIN   5         /* eighths of R i: allows for a resistance parameter twice too large */
#define MAX_Q32    (1 << 29) /* an eighth of a turn a millisecond: plausibility limit */

static int32_t emf_q15(const struct tuning *t)
{
    return ((t->align_speed_q32 / (int32_t)CONFIG_PERIODS_PER_SLOW >> CONFIG_W_SHIFT) * t->emf_q12) >> 12;
}

/* While the current changes, part of the voltage is inductive. */
static void observe_field_emf(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t)
{
    const bool steady = q15_abs(c->i_d_q15 - s->i_d_q15) < t->align[0].i_q15 / STEADY;
    s->drop_q15 = (s->i_d_q15 * t->r_q12) >> 12;
    s->e_d_q15 = q15_sat16(c->v_d_q15 - s->drop_q15); /* for any value of the resistance parameter */
    s->along_q15 = steady ? s->along_q15 + (s->e_d_q15 - s->along_q15) / ALONG_MS : 0;
    s->i_d_q15 = c->i_d_q15;
}

/* While current flows, a wrong resistance hides the EMF: then the encoder must show braking. */
static void see_braking(struct pull_speed *s, const struct tuning *t)
{
    const int32_t size_q32 = q15_abs(s->speed_q32);
    const bool fast = size_q32 > t->align_speed_q32 / FADE;
    if (fast && !s->brakes && s->along_q15 < -(emf_q15(t) / FADE + q15_abs(s->drop_q15) * R_MARGIN / 8)) {
        s->brakes = true;
        s->slowest_q32 = size_q32;
    }
    s->slowest_q32 = q15_min(s->slowest_q32, size_q32);
    if (s->brakes && (!fast || size_q32 - s->slowest_q32 >= t->align_speed_q32 / SURE)) {
        s->brakes = false;
        s->along_q15 = 0;
    }
}

/* The encoder's speed is delayed: its value at the end of the pull is known only then. */
static void see_free_run(struct pull_speed *s, const struct tuning *t)
{
    const int32_t size_q32 = q15_abs(s->speed_q32);
    s->free_ms = s->brakes || size_q32 < t->align_speed_q32 ? 0 : s->free_ms + 1;
    s->let_go_q32 = s->free_ms <= LATE * t->align_speed_ms ? size_q32 : q15_min(s->let_go_q32, size_q32);
}

void pull_speed_step(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t,
                     int32_t moved_q32)
{
    s->speed_q32 += (q15_clamp(moved_q32, -MAX_Q32, MAX_Q32) - s->speed_q32) / t->align_speed_ms;
    observe_field_emf(s, c, t);
    see_braking(s, t);
    see_free_run(s, t);
}

int32_t pull_speed_current_q15(const struct pull_speed *s, const struct tuning *t, int32_t current_q15)
{
    const int32_t left_q32 = q15_max(t->align_speed_q32 - q15_abs(s->speed_q32), 0);
    const int32_t share = left_q32 / (t->align_speed_q32 / FADE >> SHARE_BITS);
    return s->brakes ? current_q15 : (current_q15 * q15_min(share, 1 << SHARE_BITS)) >> SHARE_BITS;
}

void pull_speed_field_moves(struct pull_speed *s)
{
    s->brakes = false;
}

bool pull_speed_falls(const struct pull_speed *s, const struct tuning *t)
{
    const int32_t size_q32 = q15_abs(s->speed_q32);
    return size_q32 / FALLS > t->align_speed_q32 && size_q32 - s->let_go_q32 > t->align_speed_q32 / GAINS;
}
