/* SPDX-License-Identifier: MIT */
#include "firmware/commission/offset_check.h"

#include "firmware/commission/measure.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define DEGREE_Q32    11930465u
#define DEGREE_Q4_Q32 745654u
#define RISE_MIN_MS   30      /* limits the speed of a light rotor to what is measured in time */
#define RISE_PART     3       /* eighths of the period of oscillation about that current */
#define STILL_PART    4       /* of the rise: while the current is too small to move it */
#define STAYS_PART    2       /* of the rise: how long the current stays */
#define LONGER        4       /* times longer where it should move */
#define SPRING_Q16    1235336 /* 6 pi: three times the frequency of that oscillation */
#define DAMPING       5       /* periods of it: 1.5 times critical */
#define SPEED_MS      3       /* of the speed filter */
#define SPEED_PART    24      /* and of the period, if that is longer */
#define REST_MS       8
#define REST_PART     16 /* of the period, if that is longer */
#define REST_SHIFT    21 /* and 5 ms for a count of a degree: less motion than that is not visible */
#define REST_TIMES    8
#define CATCHES       2
#define LOST_TIMES    6   /* times a motion: travel before it is held with more current */
#define NEAR_Q4       720 /* 45 degrees */
#define AWAY_PART     8   /* of an electrical turn */
#define AWAY_TIMES    8
#define HALF_Q4       2880 /* a half turn */
#define BLIND_SHIFT   25   /* a count of 2.8 degrees */
#define SECOND_DEG    8    /* electrical: distance of the second position */
#define SECOND_MS     32   /* at least, and half a period at least, to move there */
#define WRONG_Q4      180  /* 11.25 degrees: tolerance and resolution */

enum { STEP_AXIS, STEP_HALVE, STEP_ACROSS, STEP_REVERSE };

static void push_along(struct offset_check *o, uint32_t step, uint32_t along_q32)
{
    o->step = step;
    o->holds = false;
    o->ms = 0;
    o->along_q32 = along_q32;
    o->from = o->counts;
    o->sense = 0;
}

bool offset_check_is_blind(const struct tuning *t)
{
    return t->reluctant || t->encoder_scale_q32 >> BLIND_SHIFT != 0u;
}

void offset_check_start(struct offset_check *o, const struct tuning *t, uint32_t latched, bool turns)
{
    const struct tuning_align *const level = &t->align[t->align_levels - 1u];
    *o = (struct offset_check){
        .turns = turns,
        .latched = latched,
        .moves = q15_max(2, (int32_t)(DEGREE_Q32 / 2u / t->encoder_scale_q32)),
        .i_max_q15 = level->i_q15,
        .second = (int32_t)(SECOND_DEG * DEGREE_Q32 / t->encoder_scale_q32) + 1,
        .second_ms = q15_max(SECOND_MS, level->period_ms / 2),
        .rise_ms = q15_max(RISE_MIN_MS, level->period_ms * RISE_PART / 8),
        .speed_ms = q15_max(SPEED_MS, level->period_ms / SPEED_PART),
        .damping_ms = level->period_ms * DAMPING,
        .rest_ms = q15_max(REST_MS, level->period_ms / REST_PART) + (int32_t)(t->encoder_scale_q32 >> REST_SHIFT),
    };
    push_along(o, STEP_AXIS, 180u * DEGREE_Q32);
    emf_reset(&o->emf, t);
    emf_set_count(&o->emf, t->encoder_scale_q32);
}

/* ---- the result of a push ---- */

static enum offset_result found(struct offset_check *o, int32_t off_q4)
{
    o->off_deg = off_q4 / 16;
    return OFFSET_WRONG;
}

/* Opposite to the assumed axis, where reluctance increases the torque. */
static enum offset_result push_off_axis(struct offset_check *o, int32_t middle_q4)
{
    o->middle_q4 = middle_q4;
    push_along(o, STEP_HALVE, (uint32_t)(HALF_Q4 + middle_q4) * DEGREE_Q4_Q32);
    return OFFSET_RUNNING;
}

/*
 * Right here: continues at the second position, because a mirrored angle (exchanged phases) is right at two positions of a
 * turn.
 */
static enum offset_result go_on(struct offset_check *o)
{
    push_along(o, STEP_ACROSS, 90u * DEGREE_Q32);
    return o->elsewhere ? OFFSET_RIGHT : OFFSET_RUNNING;
}

/* Side of the axis on which the magnets are, from the motion. */
static int32_t side_of(const struct offset_check *o)
{
    return o->elsewhere && !o->again ? -o->sense : o->sense;
}

/* The magnets are on the positive or negative side: tests whether by more than the tolerance. */
static enum offset_result take_side(struct offset_check *o, int32_t side)
{
    const bool mirrored = o->elsewhere && side != 0 && side == -o->side;
    o->side = o->elsewhere ? o->side : side;
    o->low_q4 = side < 0 ? -HALF_Q4 : 0;
    o->high_q4 = side > 0 ? HALF_Q4 : 0;
    if (mirrored && !o->again) {
        o->again = true;
        push_along(o, STEP_AXIS, 180u * DEGREE_Q32);
        return OFFSET_RUNNING;
    }
    if (mirrored) {
        return found(o, side * WRONG_Q4);
    }
    return side == 0 ? go_on(o) : push_off_axis(o, side * WRONG_Q4);
}

static enum offset_result take_half(struct offset_check *o)
{
    o->low_q4 = o->sense < 0 ? o->low_q4 : o->middle_q4;
    o->high_q4 = o->sense > 0 ? o->high_q4 : o->middle_q4;
    const int32_t middle_q4 = (o->low_q4 + o->high_q4) / 2;
    if (o->high_q4 - o->low_q4 > WRONG_Q4) {
        return push_off_axis(o, middle_q4);
    }
    return q15_abs(middle_q4) < WRONG_Q4 ? go_on(o) : found(o, middle_q4);
}

/* Now with opposite current, in case a load has prevented a motion in one direction. */
static enum offset_result take_across(struct offset_check *o)
{
    const int32_t sense = o->step == STEP_ACROSS ? o->sense : -o->sense;
    if (sense < 0) {
        return found(o, HALF_Q4);
    }
    if (sense == 0 && o->step == STEP_REVERSE) {
        return OFFSET_UNKNOWN;
    }
    if (sense == 0) {
        push_along(o, STEP_REVERSE, 270u * DEGREE_Q32);
    } else {
        o->elsewhere = true;
        push_along(o, STEP_AXIS, 0);
    }
    return OFFSET_RUNNING;
}

static enum offset_result conclude(struct offset_check *o)
{
    switch (o->step) {
    case STEP_AXIS:
        return take_side(o, side_of(o));
    case STEP_HALVE:
        return take_half(o);
    default:
        return take_across(o);
    }
}

/* ---- a push ---- */

/* With the square of the time, so that a large error moves the rotor by a small current. */
static int32_t rising_q15(const struct offset_check *o)
{
    const int32_t part_q15 = q15_min((int32_t)o->ms, o->rise_ms) * 32768 / o->rise_ms;
    return (int32_t)(((int64_t)o->i_max_q15 * ((part_q15 * (part_q15 / 2)) >> 14)) >> 15);
}

static void step_push(struct offset_check *o)
{
    if ((int32_t)o->ms <= o->rise_ms / STILL_PART) {
        o->from = o->counts; /* excludes motion of the previous push */
    }
    const int32_t travel = o->counts - o->from;
    const int32_t factor = o->step >= STEP_ACROSS ? LONGER : 1;
    o->i_q15 = rising_q15(o);
    if (q15_abs(travel) < o->moves && (int32_t)o->ms < factor * (o->rise_ms + o->rise_ms / STAYS_PART)) {
        return;
    }
    o->sense = q15_abs(travel) < o->moves ? 0 : travel < 0 ? -1 : 1;
    o->hold_sense = o->sense;
    o->holds = true;
    o->caught = 0;
    o->ms = 0;
    o->speed_q16 = 0;
    o->i_moves_q15 = o->i_q15;
}

static bool is_underway(const struct offset_check *o)
{
    return o->step >= STEP_ACROSS && (int32_t)o->ms < o->second_ms;
}

/*
 * Holds a load that the opposite of a weak push does not hold: with the maximum torque, at an assumed angle close to the
 * offset.
 */
static void hold_load(struct offset_check *o)
{
    const int32_t width_q4 = o->step == STEP_AXIS ? HALF_Q4 : o->high_q4 - o->low_q4;
    const int32_t within_q4 = q15_min(width_q4 / 2, NEAR_Q4);
    const int32_t side = o->step == STEP_AXIS ? side_of(o) : o->low_q4 + o->high_q4;
    const int32_t nearest_q4 = o->step == STEP_AXIS ? 0 : side > 0 ? o->low_q4 : o->high_q4;
    const int32_t guess_q4 = nearest_q4 + (side > 0 ? within_q4 : -within_q4);
    o->along_q32 = (uint32_t)(HALF_Q4 / 2 + guess_q4) * DEGREE_Q4_Q32;
    o->hold_sense = 1;
}

/* If that accelerates it, the magnets are on the opposite side. */
static void catch_load(struct offset_check *o, int32_t travel)
{
    if (o->step >= STEP_ACROSS || travel * o->sense <= LOST_TIMES * (o->caught + 1) * o->moves ||
        o->caught == CATCHES) {
        return;
    }
    o->caught++;
    if (o->caught == 1) {
        hold_load(o);
    } else {
        o->along_q32 += (uint32_t)HALF_Q4 * DEGREE_Q4_Q32;
    }
}

/* Back to the start of the push, or, with q current, on to the second position. */
static int32_t goal(const struct offset_check *o)
{
    const int32_t ms = q15_min((int32_t)o->ms, o->second_ms);
    return o->step >= STEP_ACROSS ? o->from + o->sense * (o->second * ms / o->second_ms) : o->from;
}

/*
 * Position control by spring and damper, with a current in the push's direction; on the move to the second position in addition
 * to the current that has moved it.
 */
static void step_hold(struct offset_check *o, const struct tuning *t, int32_t moved)
{
    const int32_t travel = o->counts - goal(o);
    o->speed_q16 += (moved * 65536 - o->speed_q16) / o->speed_ms;
    catch_load(o, travel);
    const int64_t pull_q16 = (int64_t)travel * SPRING_Q16 + (int64_t)o->speed_q16 * o->damping_ms;
    const int32_t share_q16 = q15_clamp((int32_t)(pull_q16 * t->encoder_scale_q32 >> 32), -65536, 65536);
    const int32_t i_q15 = -o->hold_sense * (int32_t)(((int64_t)o->i_max_q15 * share_q16) >> 16);
    o->i_q15 = q15_clamp(i_q15 + (is_underway(o) ? o->i_moves_q15 : 0), -o->i_max_q15, o->i_max_q15);
}

static bool rests(const struct offset_check *o)
{
    const int32_t max_ms = REST_TIMES * o->rest_ms + (o->step >= STEP_ACROSS ? o->second_ms : 0);
    return (o->still_ms >= o->rest_ms && (o->sense == 0 || !is_underway(o))) || (int32_t)o->ms >= max_ms;
}

/* A falling load: the motion is not caused by the current. */
static bool has_turned(const struct offset_check *o, const struct tuning *t)
{
    return q15_abs(o->counts) > t->encoder_counts / t->pole_pairs / AWAY_PART + AWAY_TIMES * o->moves;
}

static enum offset_result driven_by_load(struct offset_check *o)
{
    if (o->step < STEP_ACROSS) {
        return found(o, o->step == STEP_HALVE ? o->middle_q4 : side_of(o) * WRONG_Q4);
    }
    return take_across(o) == OFFSET_WRONG ? OFFSET_WRONG : OFFSET_UNKNOWN;
}

static bool turned_forward(const struct offset_check *o)
{
    return o->step == STEP_ACROSS ? o->sense > 0 : o->step == STEP_REVERSE && o->sense < 0;
}

static void begin_fading(struct offset_check *o)
{
    o->fades = true;
    o->ms = 0;
    o->from = o->counts;
    o->i_moves_q15 = o->i_q15;
}

/* A held load would move as the current is ramped down: the second test is then skipped. */
static enum offset_result step_fade(struct offset_check *o)
{
    const int32_t left_ms = o->rest_ms - (int32_t)o->ms;
    if (q15_abs(o->counts - o->from) >= o->moves) {
        return OFFSET_RIGHT;
    }
    o->i_q15 = o->i_moves_q15 / o->rest_ms * q15_max(left_ms, 0);
    o->fades = left_ms > 0;
    return o->fades ? OFFSET_RUNNING : conclude(o);
}

static enum offset_result step_pushes(struct offset_check *o, volatile struct current_loop *c, const struct tuning *t,
                                      int32_t moved)
{
    enum offset_result result = OFFSET_RUNNING;
    o->ms++;
    if (!o->holds) {
        step_push(o);
    } else if (o->fades) {
        result = step_fade(o);
    } else if (has_turned(o, t)) {
        result = driven_by_load(o);
    } else if (rests(o) && turned_forward(o)) {
        begin_fading(o);
    } else if (rests(o)) {
        result = conclude(o);
        o->i_q15 = 0;
    } else {
        step_hold(o, t, moved);
    }
    const cossin_t along = cossin_q15(o->along_q32);
    current_loop_set_currents(c, (o->i_q15 * along.cos) >> 15, (o->i_q15 * along.sin) >> 15);
    return result;
}

/* ---- a turning rotor ---- */

static enum offset_result step_emf(struct offset_check *o, const volatile struct current_loop *c,
                                   const struct tuning *t)
{
    const int32_t w_q15 = current_loop_w_q15(c);
    emf_step(&o->emf, c, t, w_q15, w_q15);
    o->ms++;
    if (o->ms < 3u << o->emf.filter_shift) {
        return OFFSET_RUNNING;
    }
    if (!emf_is_clear(&o->emf)) {
        return OFFSET_UNKNOWN;
    }
    o->off_deg = emf_angle_deg(&o->emf.filtered, w_q15 < 0);
    return emf_judge(&o->emf, w_q15 < 0) == EMF_AGREES ? OFFSET_RIGHT : OFFSET_WRONG;
}

enum offset_result offset_check_step(struct offset_check *o, volatile struct current_loop *c, const struct tuning *t,
                                     uint32_t latched)
{
    const int32_t moved = measure_counts(o->latched, latched, t->encoder_counts);
    o->latched = latched;
    o->counts += moved;
    o->still_ms = moved == 0 ? o->still_ms + 1 : 0;
    return o->turns ? step_emf(o, c, t) : step_pushes(o, c, t, moved);
}
