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
 * The magnets' axis, measured without current once the rotor rests. Where reluctance outweighs the magnets that is done before
 * the rotor is pulled, and again after it has turned; in other salient machines after it has turned.
 */

/* ==== saliency ==== */

#define STEP_Q32 (0x80000000u / SALIENCY_ANGLES)

/*
 * The voltage, in halves, of each millisecond, and what the current read at its beginning counts for: what the whole waves
 * change it by. A steady drift, be it offset or a turning rotor, counts for nothing. Each angle leaves a little current behind,
 * because the dead time takes from both ends of the pattern; the next one begins the other way round, and takes it back.
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
 * A current that stands, from a rotor that rocks or from the dead time, would tilt what saturated iron answers. A steady
 * voltage takes it away during this pattern: all of it along d, less along q, where the inductance is larger.
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
    return measure_axes_easy_q32(&s->sums);
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
#define NORTH_Q32      (DEGREES_45_Q32 / 9 * 16) /* 80 degrees, */
#define RUBBING_Q32    (DEGREES_45_Q32 / 45 * 6) /* and this more where friction holds the rotor back */

/*
 * The magnets' axis is known, but not its sense: a field across them is never opposite to where reluctance holds the rotor,
 * which swings by no more than 90 degrees less the angle that the magnets keep from the current.
 */
static void pull_across(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    a->first_offset_q32 = saliency_offset_q32(&a->axis);
    a->field_q32 = angle_q32 + a->first_offset_q32 + QUARTER_Q32;
    pendulum_start(&a->rotor, t->align[a->level].period_ms, angle_q32, a->field_q32);
    a->target_q15 =
        t->align[a->level].i_q15 / 3 * 2; /* reluctance still outweighs the magnets, and the rotor swings slower */
    a->origin = a->counts;
    alignment_enter(a, STAGE_PULL);
}

static enum alignment_result step_drop(struct alignment *a, volatile struct current_loop *c, const struct tuning *t)
{
    current_loop_ask_d(c, 0);
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

/* The difference of two offsets that are known up to half a turn. */
static int32_t apart_q32(uint32_t x_q32, uint32_t y_q32)
{
    return q15_abs((int32_t)(2u * (x_q32 - y_q32)) / 2);
}

/* Of the axis's two ends the one near `angle_q32`. */
static uint32_t nearer_end_q32(uint32_t offset_q32, uint32_t angle_q32)
{
    const bool near = angle_size_q32((int32_t)(angle_q32 - offset_q32)) <= QUARTER_Q32;
    return near ? offset_q32 : offset_q32 + 2u * QUARTER_Q32;
}

/*
 * The rotor hung on the field with its north pole within `most_q32` of it, which is less than a quarter of a turn: that tells
 * the axis's sense. A load has shifted it both times one way; friction, which may be the larger, has not shifted the mean.
 */
static enum alignment_result judge_north(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                         uint32_t angle_q32, uint32_t offset_q32, uint32_t max_q32)
{
    const int32_t forward_q32 = (int32_t)(a->load.forward_q32[0] - offset_q32);
    const int32_t back_q32 = (int32_t)(a->load.back_q32[0] - offset_q32);
    const uint32_t mean_q32 = angle_size_q32(forward_q32 / 2 + back_q32 / 2);
    const uint32_t away_q32 = mean_q32 + angle_size_q32(forward_q32 / 2 - back_q32 / 2);
    if (mean_q32 > max_q32 || away_q32 > max_q32 + RUBBING_Q32) {
        a->detail[0] = (int32_t)(away_q32 / (DEGREES_45_Q32 / 45));
        return alignment_again(a, t, angle_q32, ALIGNMENT_LOAD);
    }
    current_loop_offset(c, offset_q32);
    return ALIGNMENT_DONE;
}

/*
 * Reluctance held the rotor: too near to 90 degrees nothing is told. What an encoder that does not count says of the axis is
 * whether the rotor has turned.
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
 * The magnets held the rotor: the axis, which no load shifts, replaces what the passes tell of the offset. Only they tell it
 * without saliency, whatever was told, and of a rotor that a load turned while the axis was measured.
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
 * The steps of alignment: the rotor is pulled to two angles of the field, turned (alignment_turns.c) and let go, in
 * most salient machines for their axis to be measured (above).
 */

#define JUMP_MS        8u /* for a quarter turn: a rotor opposite the field must not meet it half way */
#define SETTLE_PERIODS 10
#define SETTLE_MS      60
#define RATIO_MAX      32
#define GRIP_MS        5
#define BACK_PART      16 /* of a period: how long the current takes to return */
#define AWAY_TURNS     3  /* no field pulls the rotor further than this from its start */
#define TURNS_BACK     4  /* part of a period: a jumping field may meet the rotor moving away from it */

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

/* Current follows its target within half a period; at once to hold a falling rotor. */
static void follow_current(struct alignment *a, const struct tuning *t)
{
    const int32_t half_ms = a->gripped || t->reluctant ? GRIP_MS : a->period_ms / 2;
    const int32_t slope_q15 = q15_max(t->align[a->level].i_q15 / half_ms, 1);
    a->current_q15 = measure_towards(a->current_q15, a->target_q15, slope_q15);
}

/* It hangs on the field, and its swing is damped: from here on it does not come from the other side. */
static bool hangs(const struct alignment *a)
{
    return a->stage == STAGE_SECOND && a->rotor.sense != 0;
}

/*
 * A reluctance machine is held where it is first pulled across its magnets, and swings less. A rotor that hangs on the field
 * may ring on its coupling, and a current that follows that speed would shake it: so the current comes back slowly.
 */
static int32_t pull_current_q15(struct alignment *a, const struct tuning *t)
{
    if (a->gripped || t->reluctant) {
        return a->current_q15;
    }
    const int32_t more_q15 = a->current_q15 / q15_max(a->rotor.period_ms / BACK_PART, 1) + 1;
    const int32_t now_q15 = pull_speed_current_q15(&a->speed, t, a->current_q15);
    a->pull_q15 = hangs(a) ? q15_min(now_q15, a->pull_q15 + more_q15) : now_q15;
    return a->pull_q15;
}

/* A rotor that runs away without current falls with its load: then all the available current holds it. */
static void grip(struct alignment *a, const struct tuning *t)
{
    if (!t->reluctant && a->stage < STAGE_PASS && !a->gripped && pull_speed_falls(&a->speed, t)) {
        a->level = t->align_levels - 1u;
        a->target_q15 = t->align[a->level].i_q15;
        a->gripped = true;
        a->rotor.sense = 0; /* while falling it may have been anywhere relative to the field */
        alignment_begin_swing(a);
    }
}

/* During the pull the rotor turns half a turn to the field and a quarter with it, and swings; any further is a load. */
bool alignment_check_external_drive(struct alignment *a, const struct tuning *t)
{
    const int32_t turns = a->stage < STAGE_PASS ? AWAY_TURNS : ALIGNMENT_TURNS;
    grip(a, t);
    return q15_abs(a->counts - a->origin) > turns * t->encoder_counts / t->pole_pairs;
}

/* Settled, or waited long enough: longer if nothing damps it. */
static bool at_rest(const struct alignment *a)
{
    const int32_t max_ms = a->period_ms * SETTLE_PERIODS * (a->rotor.sense == 0 ? 2 : 1) + SETTLE_MS;
    return a->current_q15 == a->target_q15 && (pendulum_settled(&a->rotor) || (int32_t)a->stage_ms >= max_ms);
}

/*
 * Reluctance holds the rotor behind the field or ahead of it. If ahead, friction would drag it to the other side as the field
 * begins to turn; a quarter turn of the field does that at rest.
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
 * slower, since the rotor is faster than it seems. Friction alone changes that little.
 */
static void judge_jump(struct alignment *a, const struct tuning *t)
{
    const int32_t quarter = t->encoder_counts / t->pole_pairs / 4 + 1;
    const int32_t seen = q15_abs(a->counts - a->jump_from) * (int32_t)RATIO_ONE / quarter;
    a->ratio = (uint32_t)q15_clamp(seen, (int32_t)RATIO_ONE, RATIO_MAX);
}

/* A second attempt has more current, and pulls the rotor along. */
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

/* ---- all of it ---- */

/* The current is gone: from now on the offset does not change. */
static enum alignment_result step_release(struct alignment *a, volatile struct current_loop *c)
{
    if (a->current_q15 != 0) {
        return ALIGNMENT_RUNNING;
    }
    current_loop_ask(c, 0, 0);
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

/* ==== the speed while it pulls ==== */

#define SHARE_BITS 8         /* of the current */
#define FADE       2         /* full current up to this part of the speed */
#define FALLS      2         /* times the speed */
#define STEADY     16        /* part of the current: if it changes by more, inductance takes the voltage */
#define ALONG_MS   2         /* one noisy sample is no braking */
#define LATE       2         /* times align_speed_ms: so late does the encoder tell the speed */
#define GAINS      2         /* a rotor that falls gains this part of the allowed speed */
#define SURE       4         /* one that gains this part of it is not braked */
#define DOUBT      5         /* eighths of R i: with a resistance told twice too large, half of R i is not there */
#define MAX_Q32    (1 << 29) /* an eighth of a turn in a millisecond: nothing is so fast here */

static int32_t emf_q15(const struct tuning *t)
{
    return ((t->align_speed_q32 / (int32_t)CONFIG_PERIODS_PER_SLOW >> CONFIG_W_SHIFT) * t->emf_q12) >> 12;
}

/* Inductance takes voltage while the current changes. */
static void observe_field_emf(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t)
{
    const bool steady = q15_abs(c->i_d_q15 - s->i_d_q15) < t->align[0].i_q15 / STEADY;
    s->drop_q15 = (s->i_d_q15 * t->r_q12) >> 12;
    s->e_d_q15 = q15_sat16(c->v_d_q15 - s->drop_q15); /* whatever the resistance is told to be */
    s->along_q15 = steady ? s->along_q15 + (s->e_d_q15 - s->along_q15) / ALONG_MS : 0;
    s->i_d_q15 = c->i_d_q15;
}

/* While the current flows, a resistance told wrongly hides what is induced: from then on the encoder has to show it. */
static void see_braking(struct pull_speed *s, const struct tuning *t)
{
    const int32_t size_q32 = q15_abs(s->speed_q32);
    const bool fast = size_q32 > t->align_speed_q32 / FADE;
    if (fast && !s->brakes && s->along_q15 < -(emf_q15(t) / FADE + q15_abs(s->drop_q15) * DOUBT / 8)) {
        s->brakes = true;
        s->slowest_q32 = size_q32;
    }
    s->slowest_q32 = q15_min(s->slowest_q32, size_q32);
    if (s->brakes && (!fast || size_q32 - s->slowest_q32 >= t->align_speed_q32 / SURE)) {
        s->brakes = false;
        s->along_q15 = 0;
    }
}

/* The encoder tells the speed late: what it was at the end of the pull shows only then. */
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
