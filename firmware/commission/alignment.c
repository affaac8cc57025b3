/* SPDX-License-Identifier: MIT */
/*
 * The steps of alignment: the rotor is pulled to two angles of the field, turned (alignment_turns.c) and let go, in
 * most salient machines for their axis to be measured (alignment_axis.c).
 */
#include "firmware/commission/alignment.h"

#include "firmware/commission/alignment_parts.h"
#include "firmware/commission/measure.h"
#include "firmware/settings/config.h"
#include "lib/q15.h"

#define JUMP_MS        8u /* for a quarter turn: a rotor opposite the field must not meet it half way */
#define SETTLE_PERIODS 10
#define SETTLE_MS      60
#define RATIO_MOST     32
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
bool alignment_carried_away(struct alignment *a, const struct tuning *t)
{
    const int32_t turns = a->stage < STAGE_PASS ? AWAY_TURNS : ALIGNMENT_TURNS;
    grip(a, t);
    return q15_abs(a->counts - a->origin) > turns * t->encoder_counts / t->pole_pairs;
}

/* Settled, or waited long enough: longer if nothing damps it. */
static bool at_rest(const struct alignment *a)
{
    const int32_t most_ms = a->period_ms * SETTLE_PERIODS * (a->rotor.sense == 0 ? 2 : 1) + SETTLE_MS;
    return a->current_q15 == a->target_q15 && (pendulum_settled(&a->rotor) || (int32_t)a->stage_ms >= most_ms);
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
        alignment_begin_pass(a, t, PASS_FORTH);
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
    a->ratio = (uint32_t)q15_clamp(seen, (int32_t)RATIO_ONE, RATIO_MOST);
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
        alignment_begin_pass(a, t, PASS_FORTH);
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
    alignment_feel_sense(a, c, t, moved, angle_q32);
    follow_current(a, t);
    if (alignment_carried_away(a, t)) {
        a->detail[0] = ALIGNMENT_OUT_DEGREES;
        return ALIGNMENT_LOAD;
    }
    if (a->stage < STAGE_DROP && a->stage != STAGE_PASS) {
        pendulum_step(&a->rotor, c, angle_q32, a->field_q32, 0, pull_current_q15(a, t));
    }
    return step_stage(a, c, t, angle_q32);
}

/* ==== the speed while it pulls ==== */

#define SHARE_BITS  8         /* of the current */
#define FADE        2         /* full current up to this part of the speed */
#define FALLS       2         /* times the speed */
#define STEADY      16        /* part of the current: if it changes by more, inductance takes the voltage */
#define ALONG_MS    2         /* one noisy sample is no braking */
#define LATE        2         /* times align_speed_ms: so late does the encoder tell the speed */
#define GAINS       2         /* a rotor that falls gains this part of the allowed speed */
#define SURE        4         /* one that gains this part of it is not braked */
#define DOUBT       5         /* eighths of R i: with a resistance told twice too large, half of R i is not there */
#define LARGEST_Q32 (1 << 29) /* an eighth of a turn in a millisecond: nothing is so fast here */

static int32_t emf_q15(const struct tuning *t)
{
    return ((t->align_speed_q32 / (int32_t)CONFIG_PERIODS_PER_SLOW >> CONFIG_W_SHIFT) * t->emf_q12) >> 12;
}

/* Inductance takes voltage while the current changes. */
static void feel_field(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t)
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
    s->speed_q32 += (q15_clamp(moved_q32, -LARGEST_Q32, LARGEST_Q32) - s->speed_q32) / t->align_speed_ms;
    feel_field(s, c, t);
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
