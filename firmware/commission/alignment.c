/* SPDX-License-Identifier: MIT */
#include "firmware/commission/alignment.h"

#include "firmware/commission/encoder_fit.h"
#include "firmware/settings/config.h"
#include "lib/q15.h"

#define JUMP_MS        8u /* for a quarter turn: a rotor opposite to the field must not meet it half way */
#define QUARTER_Q32    0x40000000u
#define PERIODS_A_TURN 2 /* of the pendulum, in which the field turns once */
#define SETTLE_PERIODS 10
#define SLOWER         4 /* times, at the second attempt */
#define SETTLE_MS      60
#define EVEN_ONE_IN    64 /* forth and back agree so far, and but for these counts */
#define EVEN_COUNTS    6
#define ATTEMPTS       2u
#define GRIP_TENTHS    3 /* of a turn */
#define GRIP_MS        5
#define AWAY_TURNS     3 /* further from where it began no field pulls the rotor */
#define SENSE_STEP     4096
#define FAST_COUNTS    4
#define FAST_Q32       (DEGREES_45_Q32 / 9)
#define OUT_DEGREES    180 /* the rotor did not stay with the field at all */
#define SPREAD_Q15     500 /* 0.9 degrees at the larger current; an offset that is 3 degrees off shows 550 and more */
#define STILL_MS       12u
#define STILL_MOST_MS  2000u
#define AXIS_APART_Q32 (DEGREES_45_Q32 / 9 * 2)
#define NORTH_Q32      (DEGREES_45_Q32 / 9 * 16) /* 80 degrees */
#define DEGREES_45_Q32 0x20000000
#define DEGREES_20_Q32 (DEGREES_45_Q32 / 9 * 4)

/* A third of a turn may be off by this part of itself: a rotor that swings is measured once more, and slower. */
static const int32_t EVEN_PARTS[ATTEMPTS] = {20, 3};

enum stage {
    STAGE_PULL,   /* current rises a quarter turn before the first angle, the rotor swings and settles */
    STAGE_SECOND, /* the field goes to the first angle */
    STAGE_PASS,
    STAGE_SOLVE,
    STAGE_RELEASE, /* current down to nothing */
    STAGE_DROP,    /* the same, at once, and the rotor comes to rest */
    STAGE_AXIS, /* of reluctant machines, before the pull and after the passes: where the magnets are, but for half a turn */
};

enum pass {
    PASS_FORTH,
    PASS_BACK,
    PASS_FORTH_LESS, /* less current */
    PASS_BACK_LESS,
};

static uint32_t encoder_q32(const volatile struct current_loop *c, uint32_t latched)
{
    return latched * c->encoder_scale_q32;
}

static void enter(struct alignment *a, enum stage stage)
{
    a->stage = stage;
    a->stage_ms = 0;
}

static void begin_drop(struct alignment *a, bool turned)
{
    a->turned = turned;
    a->target_q15 = 0;
    a->current_q15 = 0;
    a->still_ms = 0;
    enter(a, STAGE_DROP);
}

/* The first attempt is quick; the second has time for 16 times the inertia that was told, and as much current as there is. */
static void begin_attempt(struct alignment *a, const struct tuning *t, uint32_t attempt, uint32_t angle_q32)
{
    a->attempt = attempt;
    a->level = attempt == 0u ? 0u : t->align_levels - 1u;
    a->period_ms = attempt == 0u ? t->align[a->level].period_ms : t->align[a->level].period_ms * SLOWER;
    a->origin = a->counts;
    a->silent = false;
    a->sense = 0;
    a->fastest_q32 = 0;
    a->gripped = false;
    a->target_q15 = t->align[a->level].i_q15;
    pendulum_start(&a->rotor, t->align[a->level].period_ms, angle_q32, a->field_q32);
    enter(a, STAGE_PULL);
    if (t->reluctant) {
        begin_drop(a, false);
    }
}

void alignment_start(struct alignment *a, volatile struct current_loop *c, const struct tuning *t, uint32_t latched)
{
    *a = (struct alignment){.latched = latched, .field_q32 = 0u - QUARTER_Q32};
    begin_attempt(a, t, 0, encoder_q32(c, latched));
    current_loop_field(c, a->field_q32, 0);
}

/* The counter runs from 0 to one turn; between two steps it moves by less than half of one. Returns by how much. */
static int32_t follow_encoder(struct alignment *a, const struct tuning *t, uint32_t latched)
{
    const int32_t half = t->encoder_counts / 2;
    int32_t moved = (int32_t)latched - (int32_t)a->latched;
    moved -= moved > half ? t->encoder_counts : 0;
    moved += moved < -half ? t->encoder_counts : 0;
    a->counts += moved;
    a->latched = latched;
    return moved;
}

/*
 * Which way the encoder counts. Magnets that move induce a q voltage in the sense of their motion while they are within 90
 * degrees of the field. There they are as a rotor that swings begins to slow down; and at the latest when it has turned by a
 * third of a turn. Until then nothing is damped, for damping in the wrong sense would drive the rotor. Where reluctance holds
 * the rotor the voltage's sense changes beyond 45 degrees from the hold, and the sum of all the way counts.
 */
static void feel_sense(struct alignment *a, const volatile struct current_loop *c, const struct tuning *t,
                       int32_t moved, uint32_t angle_q32)
{
    const int32_t seen = c->v_q_q15 / 8 * q15_clamp(moved, -SENSE_STEP, SENSE_STEP);
    const int32_t speed_q32 = q15_abs(pendulum_speed_q32(&a->rotor));
    if (a->rotor.sense != 0 || a->stage >= STAGE_DROP) {
        return;
    }
    a->sense += t->reluctant ? seen / 16 : (seen - a->sense) / 4;
    a->fastest_q32 = q15_max(a->fastest_q32, speed_q32);
    const bool slows = a->fastest_q32 > q15_max(FAST_Q32, FAST_COUNTS * (int32_t)c->encoder_scale_q32) &&
                       speed_q32 < a->fastest_q32 / 2;
    if (slows || q15_abs(a->counts - a->origin) * 3 > t->encoder_counts / t->pole_pairs) {
        a->rotor.sense = a->sense < 0 ? -1 : 1;
        pendulum_start(&a->rotor, a->rotor.period_ms, angle_q32, a->field_q32);
    }
}

/* Current follows its target within half a period; to hold a rotor that falls, at once. */
static void follow_current(struct alignment *a, const struct tuning *t)
{
    const int32_t half_ms = a->gripped || t->reluctant ? GRIP_MS : a->period_ms / 2;
    const int32_t slope_q15 = q15_max(t->align[a->level].i_q15 / half_ms, 1);
    a->current_q15 += q15_clamp(a->target_q15 - a->current_q15, -slope_q15, slope_q15);
}

/* ---- pulling ---- */

/*
 * The magnets' axis is known, but not its sense: a field across them is never opposite to where reluctance holds the rotor,
 * which swings by no more than 90 degrees less the angle that the magnets keep from the current.
 */
static void pull_across(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    a->first_offset_q32 = saliency_offset_q32(&a->axis);
    a->field_q32 = angle_q32 + a->first_offset_q32 + QUARTER_Q32;
    pendulum_start(&a->rotor, t->align[a->level].period_ms, angle_q32, a->field_q32);
    a->target_q15 = t->align[a->level].i_q15;
    a->origin = a->counts;
    enter(a, STAGE_PULL);
}

/* Settled, or waited long enough. */
static bool at_rest(const struct alignment *a)
{
    return a->current_q15 == a->target_q15 &&
           (pendulum_settled(&a->rotor) || (int32_t)a->stage_ms >= a->period_ms * SETTLE_PERIODS + SETTLE_MS);
}

static bool whole_turn(uint32_t pass)
{
    return pass < PASS_FORTH_LESS;
}

static void begin_pass(struct alignment *a, const struct tuning *t, uint32_t pass)
{
    const uint32_t period_ms = (uint32_t)a->period_ms;
    const uint32_t part_ms = (period_ms * PERIODS_A_TURN / 3u + PASS_THIRDS) / PASS_THIRDS * PASS_THIRDS;
    const uint32_t turn_ms = 3u * part_ms;
    const int32_t step_q32 = (int32_t)(UINT32_MAX / turn_ms);
    a->pass = pass;
    a->target_q15 = whole_turn(pass) ? t->align[a->level].i_q15 : t->align[a->level].i_less_q15;
    a->passing.field_q32 = a->field_q32;
    field_pass_start(&a->passing, (pass & 1u) == 0u ? step_q32 : -step_q32, period_ms,
                     whole_turn(pass) ? turn_ms : part_ms);
    enter(a, STAGE_PASS);
}

/*
 * Reluctance holds the rotor behind the field or ahead of it. Ahead, friction would take it to the other side as the field
 * begins to turn; a quarter turn of the field does that at rest.
 */
static bool leads_the_field(const struct alignment *a)
{
    return (a->counts - a->origin) * a->rotor.sense < 0;
}

static enum alignment_result step_pull(struct alignment *a, const struct tuning *t)
{
    if (at_rest(a) && t->reluctant && !leads_the_field(a)) {
        begin_pass(a, t, PASS_FORTH);
    } else if (at_rest(a)) {
        enter(a, STAGE_SECOND);
    }
    return ALIGNMENT_RUNNING;
}

static enum alignment_result step_second(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    if (a->stage_ms <= JUMP_MS) {
        a->field_q32 += QUARTER_Q32 / JUMP_MS;
        pendulum_start(&a->rotor, a->rotor.period_ms, angle_q32, a->field_q32);
    } else if (at_rest(a)) {
        begin_pass(a, t, PASS_FORTH);
    }
    return ALIGNMENT_RUNNING;
}

/* ---- verdicts ---- */

/* Nothing is said against the motor or its wiring that a second attempt does not confirm. */
static enum alignment_result again(struct alignment *a, const struct tuning *t, uint32_t angle_q32,
                                   enum alignment_result otherwise)
{
    if (a->attempt + 1u >= ATTEMPTS) {
        return otherwise;
    }
    begin_attempt(a, t, a->attempt + 1u, angle_q32);
    return ALIGNMENT_RUNNING;
}

/*
 * Whether magnets turned with the field: what they induce is half of the difference of v_q between both ways, beside what the
 * winding's own inductance does. Resistance and dead time cancel.
 */
static bool magnets_turned(const struct alignment *a, const struct tuning *t)
{
    const int32_t n = (int32_t)a->passing.measure_ms;
    const int32_t w_q15 = q15_abs(a->passing.step_q32) / (int32_t)CONFIG_LOOPS_PER_SLOW >> 13;
    const int32_t seen_q15 = (a->turn_v_q_q15[PASS_FORTH] - a->turn_v_q_q15[PASS_BACK]) / n / 2;
    const int32_t emf_q15 = (w_q15 * t->emf_q12) >> 12;
    const int32_t reactive_q15 = ((w_q15 * a->target_q15) >> 15) * q15_max(t->x_d_q11, t->x_q_q11) >> 11;
    return seen_q15 > emf_q15 / 4 + reactive_q15; /* a rotor that swings undamped shows less than half of it */
}

static enum alignment_result judge_fit(struct alignment *a, const struct tuning *t, int32_t two_turns)
{
    const struct encoder_fit fit = encoder_fit(two_turns, t->pole_pairs, t->encoder_counts);
    a->detail[0] = fit.pole_pairs != 0 ? fit.pole_pairs : t->pole_pairs;
    a->detail[1] = fit.encoder_counts;
    switch (fit.verdict) {
    case ENCODER_POLE_PAIRS:
        return ALIGNMENT_POLE_PAIRS;
    case ENCODER_COUNTS:
        return ALIGNMENT_COUNTS;
    case ENCODER_FITS:
    default:
        return ALIGNMENT_RUNNING;
    }
}

/* Both whole turns are done: what speaks against this encoder, if anything. */
static enum alignment_result judge_turns(struct alignment *a, const struct tuning *t)
{
    const int32_t forth = a->turn_counts[PASS_FORTH];
    const int32_t back = -a->turn_counts[PASS_BACK];
    const int32_t expected = t->encoder_counts / t->pole_pairs;
    a->detail[0] = forth;
    a->detail[1] = expected;
    if (q15_abs(forth) < expected / 8 && q15_abs(back) < expected / 8) {
        if (t->reluctant) {
            a->silent = true; /* a locked rotor of much saliency induces as well: the axis will tell */
            return ALIGNMENT_RUNNING;
        }
        return magnets_turned(a, t) ? ALIGNMENT_ENCODER_DEAD : ALIGNMENT_BLOCKED;
    }
    if (!a->even || q15_abs(forth - back) > q15_abs(forth + back) / EVEN_ONE_IN + EVEN_COUNTS) {
        return ALIGNMENT_BLOCKED;
    }
    return forth + back < 0 ? ALIGNMENT_DIRECTION : judge_fit(a, t, forth + back);
}

/* With less current a rotor that followed before may not: then the load is too much for that. */
static bool followed_with_less(const struct alignment *a)
{
    const int32_t third = (a->turn_counts[PASS_FORTH] - a->turn_counts[PASS_BACK]) / 6;
    const int32_t moved = q15_abs(field_pass_counts(&a->passing));
    return q15_abs(moved - third) * (a->attempt == 0u ? 10 : 4) < third;
}

static void keep_pass(struct alignment *a)
{
    const uint32_t mean_q32 = field_pass_mean_q32(&a->passing);
    const uint32_t less = whole_turn(a->pass) ? 0u : 1u;
    if ((a->pass & 1u) == 0u) {
        a->load.forth_q32[less] = mean_q32;
    } else {
        a->load.back_q32[less] = mean_q32;
    }
    if (whole_turn(a->pass)) {
        a->turn_counts[a->pass] = field_pass_counts(&a->passing);
        a->turn_v_q_q15[a->pass] = a->passing.sum_v_q_q15;
        a->even = field_pass_even(&a->passing, EVEN_PARTS[a->attempt]) && (a->pass == PASS_FORTH || a->even);
    }
}

static void begin_solve(struct alignment *a, const struct tuning *t)
{
    a->load.saliency_q15 = t->align[a->level].saliency_q15;
    a->load.ratio_q15 = t->align[a->level].ratio_q15;
    load_angle_start(&a->load);
    enter(a, STAGE_SOLVE);
}

static bool encoder_fits(const struct alignment *a, const struct tuning *t)
{
    const int32_t two_turns = q15_abs(a->turn_counts[PASS_FORTH] - a->turn_counts[PASS_BACK]);
    return encoder_fit(two_turns, t->pole_pairs, t->encoder_counts).verdict == ENCODER_FITS;
}

static enum alignment_result finish_pass(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    enum alignment_result against = ALIGNMENT_RUNNING;
    a->field_q32 = a->passing.field_q32;
    keep_pass(a);
    if (a->pass == PASS_BACK) {
        against = judge_turns(a, t);
    } else if (!whole_turn(a->pass) && !followed_with_less(a)) {
        a->detail[0] = OUT_DEGREES;
        against = ALIGNMENT_LOAD;
    }
    if (against == ALIGNMENT_DIRECTION && encoder_fits(a, t)) {
        return against; /* a whole turn backwards, evenly, forth and back: no chance */
    }
    if (against != ALIGNMENT_RUNNING) {
        return again(a, t, angle_q32, against);
    }
    if (t->reluctant && a->pass == PASS_BACK) {
        begin_drop(a, true);
    } else if (a->pass == PASS_BACK_LESS) {
        begin_solve(a, t);
    } else {
        begin_pass(a, t, a->pass + 1u);
    }
    return ALIGNMENT_RUNNING;
}

static enum alignment_result step_pass(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                       uint32_t angle_q32)
{
    if (!field_pass_step(&a->passing, &a->rotor, c, angle_q32, a->counts, a->current_q15)) {
        return ALIGNMENT_RUNNING;
    }
    return finish_pass(a, t, angle_q32);
}

static enum alignment_result step_solve(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    if (!load_angle_step(&a->load)) {
        return ALIGNMENT_RUNNING;
    }
    const int32_t largest_q32 = load_angle_largest_q32(&a->load);
    a->detail[0] = largest_q32 / (DEGREES_45_Q32 / 45);
    const bool doubtful = load_angle_spread_q15(&a->load) > SPREAD_Q15;
    if (doubtful || largest_q32 > (a->attempt == 0u ? DEGREES_20_Q32 : DEGREES_45_Q32)) {
        return again(a, t, angle_q32, ALIGNMENT_LOAD);
    }
    a->target_q15 = 0;
    enter(a, STAGE_RELEASE);
    return ALIGNMENT_RUNNING;
}

/* The current is gone: from now on the offset stays as it is. */
static enum alignment_result step_release(struct alignment *a, volatile struct current_loop *c)
{
    if (a->current_q15 != 0) {
        return ALIGNMENT_RUNNING;
    }
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    c->angle_offset_q32 = load_angle_offset_q32(&a->load);
    return ALIGNMENT_DONE;
}

/* ---- where reluctance outweighs the magnets ---- */

static enum alignment_result step_drop(struct alignment *a, volatile struct current_loop *c, const struct tuning *t)
{
    c->i_d_ref_q15 = 0;
    current_loop_field(c, a->field_q32, 0);
    if (a->still_ms >= STILL_MS) {
        saliency_start(&a->axis, t->saliency_v_q15, t->saliency_i_q15);
        enter(a, STAGE_AXIS);
    } else if (a->stage_ms > STILL_MOST_MS) {
        a->detail[0] = OUT_DEGREES;
        return ALIGNMENT_LOAD;
    }
    return ALIGNMENT_RUNNING;
}

/* By how much two offsets differ that are known but for half a turn. */
static int32_t apart_q32(uint32_t x_q32, uint32_t y_q32)
{
    return q15_abs((int32_t)(2u * (x_q32 - y_q32)) / 2);
}

/*
 * The rotor hung on the field with its north pole within 90 degrees of it: that tells the axis's sense. Friction and load
 * have shifted it one way or the other; too near to 90 degrees nothing is told.
 */
static enum alignment_result judge_axis(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                        uint32_t angle_q32)
{
    uint32_t offset_q32 = saliency_offset_q32(&a->axis);
    const bool apart = !saliency_seen(&a->axis) || apart_q32(offset_q32, a->first_offset_q32) > AXIS_APART_Q32;
    if (a->silent) {
        return again(a, t, angle_q32, apart ? ALIGNMENT_ENCODER_DEAD : ALIGNMENT_BLOCKED);
    }
    if (apart) {
        return again(a, t, angle_q32, ALIGNMENT_BLOCKED);
    }
    if (q15_abs((int32_t)(a->load.back_q32[0] - offset_q32) / 2) > (int32_t)(QUARTER_Q32 / 2)) {
        offset_q32 += 2u * QUARTER_Q32;
    }
    const int32_t forth_q32 = q15_abs((int32_t)(a->load.forth_q32[0] - offset_q32) / 2);
    const int32_t back_q32 = q15_abs((int32_t)(a->load.back_q32[0] - offset_q32) / 2);
    const int32_t most_q32 = q15_max(forth_q32, back_q32);
    if (most_q32 > NORTH_Q32 / 2) {
        a->detail[0] = most_q32 / (DEGREES_45_Q32 / 90);
        return again(a, t, angle_q32, ALIGNMENT_LOAD);
    }
    c->angle_offset_q32 = offset_q32;
    return ALIGNMENT_DONE;
}

static enum alignment_result step_axis(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                       uint32_t angle_q32)
{
    if (!saliency_step(&a->axis, c, angle_q32)) {
        return ALIGNMENT_RUNNING;
    }
    if (a->turned) {
        return judge_axis(a, c, t, angle_q32);
    }
    pull_across(a, t, angle_q32);
    return ALIGNMENT_RUNNING;
}

static enum alignment_result step_stage(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                        uint32_t angle_q32)
{
    switch (a->stage) {
    case STAGE_PULL:
        return step_pull(a, t);
    case STAGE_SECOND:
        return step_second(a, t, angle_q32);
    case STAGE_PASS:
        return step_pass(a, c, t, angle_q32);
    case STAGE_SOLVE:
        return step_solve(a, t, angle_q32);
    case STAGE_DROP:
        return step_drop(a, c, t);
    case STAGE_AXIS:
        return step_axis(a, c, t, angle_q32);
    case STAGE_RELEASE:
    default:
        return step_release(a, c);
    }
}

/* A rotor that turns further than any pull takes it falls with its load: then it is held with all the current there is. */
static void grip(struct alignment *a, const struct tuning *t)
{
    const int32_t turn = t->encoder_counts / t->pole_pairs;
    if (!t->reluctant && a->stage < STAGE_PASS && a->level + 1u < t->align_levels &&
        q15_abs(a->counts - a->origin) * 10 > turn * GRIP_TENTHS) {
        a->level = t->align_levels - 1u;
        a->target_q15 = t->align[a->level].i_q15;
        a->gripped = true;
    }
}

/* While it pulls, the rotor turns by half a turn to the field and a quarter with it, and swings; further a load takes it. */
static bool carried_away(struct alignment *a, const struct tuning *t)
{
    const int32_t turns = a->stage < STAGE_PASS ? AWAY_TURNS : ALIGNMENT_TURNS;
    grip(a, t);
    return q15_abs(a->counts - a->origin) > turns * t->encoder_counts / t->pole_pairs;
}

bool alignment_holds_voltage(const struct alignment *a)
{
    return a->stage == STAGE_AXIS;
}

enum alignment_result alignment_step(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                     uint32_t latched)
{
    const uint32_t angle_q32 = encoder_q32(c, latched);
    const int32_t moved = follow_encoder(a, t, latched);
    a->stage_ms++;
    a->still_ms = moved == 0 ? a->still_ms + 1u : 0u;
    feel_sense(a, c, t, moved, angle_q32);
    follow_current(a, t);
    if (carried_away(a, t)) {
        a->detail[0] = OUT_DEGREES;
        return ALIGNMENT_LOAD;
    }
    if (a->stage < STAGE_DROP && a->stage != STAGE_PASS) {
        pendulum_step(&a->rotor, c, angle_q32, a->field_q32, 0, a->current_q15);
    }
    return step_stage(a, c, t, angle_q32);
}
