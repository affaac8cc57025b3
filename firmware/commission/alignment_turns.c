/* SPDX-License-Identifier: MIT */
#include <stdbool.h>
#include <stddef.h>

#include "drivers/fabric/encoder.h"
#include "firmware/commission/alignment.h"
#include "firmware/commission/alignment_parts.h"
#include "firmware/settings/config.h"
#include "lib/angle.h"
#include "lib/q15.h"
#include "lib/trig.h"

/* ==== the encoder's direction ==== */

/* ==== the encoder's direction ==== */

void encoder_sense_start(struct encoder_sense *s)
{
    *s = (struct encoder_sense){0};
}

void encoder_sense_step(struct encoder_sense *s, int32_t e_d_q15, int32_t e_q_q15, uint32_t field_q32,
                        uint32_t angle_q32, int32_t moved)
{
    const cossin_t f = cossin_q15(field_q32);
    const cossin_t x = cossin_q15(angle_q32);
    const int64_t d = (int64_t)((e_d_q15 * f.cos - e_q_q15 * f.sin) >> 15) * moved;
    const int64_t q = (int64_t)((e_q_q15 * f.cos + e_d_q15 * f.sin) >> 15) * moved;
    s->cd += d * x.cos;
    s->sd += d * x.sin;
    s->cq += q * x.cos;
    s->sq += q * x.sin;
}

/* Shifted right by this much, all four fit in 15 bits and a sign. */
static uint32_t places(const struct encoder_sense *s)
{
    const int64_t bits =
        (s->cd ^ (s->cd >> 63)) | (s->sd ^ (s->sd >> 63)) | (s->cq ^ (s->cq >> 63)) | (s->sq ^ (s->sq >> 63));
    uint32_t n = 0;
    while (bits >> n > Q15_ONE) {
        n++;
    }
    return n;
}

int32_t encoder_sense_q15(const struct encoder_sense *s)
{
    const uint32_t n = places(s);
    const int32_t cd = (int32_t)(s->cd >> n), sd = (int32_t)(s->sd >> n);
    const int32_t cq = (int32_t)(s->cq >> n), sq = (int32_t)(s->sq >> n);
    const int32_t size_q30 = (cd * cd >> 2) + (sd * sd >> 2) + (cq * cq >> 2) + (sq * sq >> 2);
    const int32_t difference_q30 = (cd * sq >> 1) - (cq * sd >> 1);
    return size_q30 == 0 ? 0 : difference_q30 / (size_q30 / (1 << 15) + 1);
}

#define SENSE_STEP  4096
#define FAST_PART   2 /* of the speed limit: distinguishes an oscillation from single counts */
#define SLOW_PART   4 /* of the fastest */
#define TURN_PARTS  24
#define SWING_PARTS 2 /* of a turn: more than an oscillation between detent positions */
#define FAR_PARTS   10
#define LIKELY_Q15  12000 /* of alignment.h: a quarter of a turn */
#define SURE_Q15    28000 /* half a turn, or some oscillations */

void alignment_begin_swing(struct alignment *a)
{
    a->sense_sum = 0;
    a->v_q_sum_q15 = 0;
    a->swing_ms = 0;
    a->swing_from = a->counts;
    a->furthest = 0;
    a->fastest_q32 = 0;
}

/* Counts of parts of an electrical turn by the parameters, in 24ths. */
static int32_t turn_parts(const struct tuning *t, int32_t parts)
{
    return t->encoder_counts * parts / (TURN_PARTS * t->pole_pairs);
}

static void follow_swing(struct alignment *a, const volatile struct current_loop *c, int32_t moved, uint32_t angle_q32,
                         uint32_t field_q32)
{
    encoder_sense_step(&a->turned_with, a->speed.e_d_q15, c->v_q_q15, field_q32, angle_q32, moved);
    a->sense_sum += c->v_q_q15 * moved;
    a->v_q_sum_q15 += c->v_q_q15;
    a->swing_ms++;
    a->fastest_q32 = q15_max(a->fastest_q32, q15_abs(a->speed.speed_q32));
    a->furthest = q15_max(a->furthest, q15_abs(a->counts - a->swing_from));
}

/* It is about to reverse. */
static bool slows(const struct alignment *a, const struct tuning *t)
{
    return a->furthest > turn_parts(t, SWING_PARTS) && a->fastest_q32 > t->align_speed_q32 / FAST_PART &&
           q15_abs(a->speed.speed_q32) < a->fastest_q32 / SLOW_PART;
}

/* The rotor has reversed and is half way back. */
static bool comes_back(const struct alignment *a, const struct tuning *t)
{
    return a->furthest > turn_parts(t, SWING_PARTS) && q15_abs(a->counts - a->swing_from) < a->furthest / 2;
}

/*
 * Near the field the q voltage has the sign of the speed: their correlation, without the constant part. In a reluctance machine
 * the constant part counts, too, because its rotor hardly oscillates.
 */
static int64_t voltage_with_motion(const struct alignment *a, const struct tuning *t)
{
    const int64_t constant = (int64_t)a->v_q_sum_q15 * (a->counts - a->swing_from);
    return t->reluctant ? a->sense_sum : a->sense_sum * (int64_t)a->swing_ms - constant;
}

/* Since this attempt began. */
static bool has_moved(const struct alignment *a, const struct tuning *t, int32_t parts)
{
    return q15_abs(a->counts - a->origin) > turn_parts(t, parts);
}

/*
 * The encoder's counting direction (alignment.h). Until it is known there is no damping, because damping of the wrong sign
 * would excite. Voltages are small here; they are conclusive when the rotor has moved forward and half way back, because the
 * dead-time error has cancelled by then. A rotor that oscillates by less than a quarter turn is near the field
 * (voltage_with_motion). One that does not oscillate follows the first pass, which is conclusive; so is half a turn, once the
 * rotor is about to reverse: at full speed the field must not move, because it would take the rotor with it.
 *
 * If reluctance holds the rotor, the voltage's sign changes beyond 45 degrees from the rest position, and the whole motion is
 * evaluated.
 */
void alignment_observe_direction(struct alignment *a, const volatile struct current_loop *c, const struct tuning *t,
                                 int32_t moved, uint32_t angle_q32)
{
    if (a->rotor.sense != 0 || a->stage >= STAGE_DROP) {
        return;
    }
    const uint32_t field_q32 = a->stage == STAGE_PASS ? a->passing.field_q32 : a->field_q32;
    follow_swing(a, c, q15_clamp(moved, -SENSE_STEP, SENSE_STEP), angle_q32, field_q32);
    const int32_t shown_q15 = t->reluctant ? 0 : encoder_sense_q15(&a->turned_with);
    const bool swung = t->reluctant ? slows(a, t) || has_moved(a, t, FAR_PARTS) : comes_back(a, t);
    const bool sure = q15_abs(shown_q15) > SURE_Q15 && (a->stage == STAGE_PASS || slows(a, t));
    if (sure || (swung && q15_abs(shown_q15) > LIKELY_Q15)) {
        a->rotor.sense = shown_q15 < 0 ? -1 : 1;
    } else if (swung) {
        a->rotor.sense = voltage_with_motion(a, t) < 0 ? -1 : 1;
    }
    if (a->rotor.sense != 0) {
        pendulum_start(&a->rotor, a->rotor.period_ms, angle_q32, field_q32);
    }
}

/* ==== attempts ==== */

/* A second attempt, before a fault of motor or wiring is reported. */

#define SLOWER 4 /* times, at the second attempt */

static void alignment_begin_drop(struct alignment *a, bool turned)
{
    a->turned = turned;
    a->target_q15 = 0;
    a->current_q15 = 0;
    a->still_ms = 0;
    alignment_enter(a, STAGE_DROP);
}

/* The first attempt is quick; the second allows for 16 times the inertia parameter, and uses the maximum current. */
void alignment_begin_attempt(struct alignment *a, const struct tuning *t, uint32_t attempt, uint32_t angle_q32)
{
    a->attempt = attempt;
    a->level = attempt == 0u ? 0u : t->align_levels - 1u;
    a->period_ms = attempt == 0u ? t->align[a->level].period_ms : t->align[a->level].period_ms * SLOWER;
    a->origin = a->counts;
    a->silent = false;
    encoder_sense_start(&a->turned_with);
    alignment_begin_swing(a);
    a->held_firmly = false;
    a->ratio = RATIO_ONE;
    a->target_q15 = t->align[a->level].i_q15;
    pendulum_start(&a->rotor, t->align[a->level].period_ms, angle_q32, a->field_q32);
    alignment_enter(a, STAGE_PULL);
    if (t->reluctant) {
        alignment_begin_drop(a, false);
    }
}

/* A fault of motor or wiring must be confirmed by the second attempt. */
enum alignment_result alignment_again(struct alignment *a, const struct tuning *t, uint32_t angle_q32,
                                      enum alignment_result otherwise)
{
    if (a->attempt + 1u >= ALIGNMENT_ATTEMPTS) {
        return otherwise;
    }
    alignment_begin_attempt(a, t, a->attempt + 1u, angle_q32);
    return ALIGNMENT_RUNNING;
}

/* ==== turning ==== */

/* The field turns forward and back; the rotor's motion shows encoder errors and load. */

/* ==== the encoder against the field ==== */

#define OFF_BY_ONE_IN  77  /* 1.3 % */
#define SNAP_ONE_IN    100 /* a standard count this close is assumed */
#define EDGES_Q4       8   /* half a count in two turns */
#define TWO_TURNS_Q4   32  /* of a pole pair, per count of a turn of the shaft */
#define COUNTS_MAX_Q4  (1 << 23)
#define POLE_PAIRS_MAX 50

/* Usual lines per turn; the counts are four times these. */
static const uint16_t usual_lines[] = {100,  120,  125,  128,  180,  200,  250,  256,   300,  360,  400,
                                       500,  512,  600,  625,  720,  800,  900,  1000,  1024, 1080, 1200,
                                       1250, 1440, 1500, 1600, 1800, 2000, 2048, 2250,  2400, 2500, 2880,
                                       3000, 3600, 4000, 4096, 5000, 7200, 8192, 10000, 16384};

/* Rounds the measurement, accurate to some thousandths, to a standard count close by, or else to whole lines. */
static int32_t usual_counts(int32_t counts)
{
    int32_t best = q15_clamp((counts + 2) / 4 * 4, (int32_t)ENCODER_COUNTS_MIN, (int32_t)ENCODER_COUNTS_MAX);
    int32_t off = counts / SNAP_ONE_IN;
    for (size_t i = 0; i < sizeof usual_lines / sizeof usual_lines[0]; i++) {
        const int32_t distance = q15_abs(counts - 4 * usual_lines[i]);
        if (distance < off) {
            best = 4 * usual_lines[i];
            off = distance;
        }
    }
    return best;
}

/* Pole pairs within a tenth of a whole number, or 0. */
static int32_t whole_pole_pairs(int32_t two_turns_q4, int32_t encoder_counts)
{
    const int32_t tenths = (10 * TWO_TURNS_Q4 * encoder_counts + two_turns_q4 / 2) / two_turns_q4;
    const int32_t nearest = (tenths + 5) / 10;
    return q15_abs(tenths - 10 * nearest) <= 1 && nearest >= 1 && nearest <= POLE_PAIRS_MAX ? nearest : 0;
}

static bool fits(int32_t seen_q4, int32_t pole_pairs, int32_t encoder_counts)
{
    const int32_t expected_q4 = TWO_TURNS_Q4 * encoder_counts;
    return q15_abs(seen_q4 * pole_pairs - expected_q4) < expected_q4 / OFF_BY_ONE_IN + EDGES_Q4 * pole_pairs;
}

struct encoder_fit encoder_fit(int32_t two_turns_q4, int32_t pole_pairs, int32_t encoder_counts)
{
    const int32_t seen_q4 = q15_clamp(two_turns_q4, 1, COUNTS_MAX_Q4);
    if (fits(seen_q4, pole_pairs, encoder_counts)) {
        return (struct encoder_fit){ENCODER_FITS, pole_pairs, encoder_counts};
    }
    const int32_t whole = whole_pole_pairs(seen_q4, encoder_counts);
    const bool pairs = whole != 0 && whole != pole_pairs && !fits(seen_q4, pole_pairs, 4 * encoder_counts);
    return (struct encoder_fit){pairs ? ENCODER_POLE_PAIRS : ENCODER_COUNTS, whole,
                                usual_counts((seen_q4 * pole_pairs + TWO_TURNS_Q4 / 2) / TWO_TURNS_Q4)};
}

/* ==== the load's angle ==== */

#define WIDTH_Q32 ((int32_t)(UINT32_MAX / 6u)) /* 60 degrees: a larger load cannot be held at both currents */
#define STEPS     20u                          /* 60 degrees by 2^20 */
#define MORE_PART 4                            /* of the saliency, a parameter, and reduced by saturation */

int32_t load_angle_torque_q15(int32_t current_q15, int32_t saliency_q15, uint32_t angle_q32)
{
    const cossin_t c = cossin_q15(angle_q32);
    const int32_t reluctance_q15 = (((saliency_q15 * current_q15) >> 15) * c.cos) >> 15;
    return (((c.sin * current_q15) >> 15) * (Q15_ONE - reluctance_q15)) >> 15;
}

void load_angle_start(struct load_angle *a)
{
    a->centre_q32 = a->back_q32[0] + (uint32_t)((int32_t)(a->forward_q32[0] - a->back_q32[0]) / 2);
    a->low_q32 = -WIDTH_Q32;
    a->high_q32 = WIDTH_Q32;
    a->steps = 0;
    a->more_salient_q32 = 0;
}

/* Sum over both directions of the torque at the larger current, less that at the smaller. It decreases with the offset. */
static int32_t difference_q15(const struct load_angle *a, int32_t saliency_q15, uint32_t offset_q32)
{
    return load_angle_torque_q15(Q15_ONE, saliency_q15, a->forward_q32[0] - offset_q32) +
           load_angle_torque_q15(Q15_ONE, saliency_q15, a->back_q32[0] - offset_q32) -
           load_angle_torque_q15(a->ratio_q15, saliency_q15, a->forward_q32[1] - offset_q32) -
           load_angle_torque_q15(a->ratio_q15, saliency_q15, a->back_q32[1] - offset_q32);
}

/* Two bisections: with a quarter more saliency, then with the parameter's. */
bool load_angle_step(struct load_angle *a)
{
    const int32_t more_q15 = a->steps < STEPS ? a->saliency_q15 / MORE_PART : 0;
    const int32_t middle_q32 = a->low_q32 + (a->high_q32 - a->low_q32) / 2;
    if (difference_q15(a, a->saliency_q15 + more_q15, a->centre_q32 + (uint32_t)middle_q32) > 0) {
        a->low_q32 = middle_q32;
    } else {
        a->high_q32 = middle_q32;
    }
    a->steps++;
    if (a->steps == STEPS) {
        a->more_salient_q32 = a->low_q32;
        a->low_q32 = -WIDTH_Q32;
        a->high_q32 = WIDTH_Q32;
    }
    return a->steps >= 2u * STEPS;
}

uint32_t load_angle_uncertainty_q32(const struct load_angle *a)
{
    return angle_size_q32(a->more_salient_q32 - a->low_q32);
}

int32_t load_angle_spread_q15(const struct load_angle *a)
{
    const uint32_t offset_q32 = load_angle_offset_q32(a);
    return q15_abs(load_angle_torque_q15(Q15_ONE, a->saliency_q15, a->forward_q32[0] - offset_q32) -
                   load_angle_torque_q15(a->ratio_q15, a->saliency_q15, a->forward_q32[1] - offset_q32));
}

uint32_t load_angle_largest_q32(const struct load_angle *a)
{
    const uint32_t offset_q32 = load_angle_offset_q32(a);
    const uint32_t forward_q32 = angle_size_q32((int32_t)(a->forward_q32[0] - offset_q32));
    const uint32_t back_q32 = angle_size_q32((int32_t)(a->back_q32[0] - offset_q32));
    return forward_q32 > back_q32 ? forward_q32 : back_q32;
}

#define PERIODS_A_TURN  2  /* of the oscillation, for one turn of the field */
#define EVEN_ONE_IN     64 /* allowed difference of forward and back, and in counts */
#define EVEN_COUNTS     6
#define SILENT_PART     60  /* of the expected travel: less than with fifty pole pairs instead of one */
#define SPREAD_Q15      450 /* 0.8 degrees at the larger current; an offset error of 3 degrees gives more */
#define COUNT_SHIFT     18  /* and a thirteenth of a count: a third of a turn is not a whole number of counts */
#define DEGREES_12_Q32  (DEGREES_45_Q32 / 15 * 4)
#define UNCERTAINTY_Q32 (DEGREES_45_Q32 / 18) /* 2.5 degrees */

/* Allowed deviation of a third of a turn: an oscillating rotor is measured again, more slowly. */
static const int32_t EVEN_PARTS[ALIGNMENT_ATTEMPTS] = {20, 3};

static bool whole_turn(uint32_t pass)
{
    return pass < PASS_FORWARD_REDUCED;
}

/* From here on the rotor is held, with the maximum current, which reduces the effect of cogging and friction. */
static void hold_firmly(struct alignment *a, const struct tuning *t)
{
    a->level = t->align_levels - 1u;
    a->rotor.period_ms = t->align[a->level].period_ms; /* keeps its damping */
    if (a->attempt == 0u) {
        a->period_ms = a->rotor.period_ms;
    }
}

void alignment_begin_pass(struct alignment *a, const struct tuning *t, uint32_t pass)
{
    if (pass == PASS_FORWARD && !t->reluctant) {
        hold_firmly(a, t);
    }
    const uint32_t period_ms = (uint32_t)a->period_ms;
    const uint32_t quick_ms = period_ms * PERIODS_A_TURN;
    const uint32_t slow_ms = UINT32_MAX / (uint32_t)t->align_speed_q32 / 3u * 4u; /* leaves a margin for oscillation */
    const uint32_t wanted_ms = slow_ms > quick_ms ? slow_ms : quick_ms;
    const uint32_t part_ms = (wanted_ms / 3u + PASS_THIRDS) / PASS_THIRDS * PASS_THIRDS;
    const uint32_t turn_ms = 3u * part_ms;
    const int32_t step_q32 = (int32_t)(UINT32_MAX / turn_ms);
    a->pass = pass;
    a->target_q15 = whole_turn(pass) ? t->align[a->level].i_q15 : t->align[a->level].i_less_q15;
    a->passing.field_q32 = a->field_q32;
    /* With too many pole pairs in the parameters the rotor oscillates more slowly, by the same factor. */
    field_pass_start(&a->passing, (pass & 1u) == 0u ? step_q32 : -step_q32, period_ms * a->ratio / RATIO_ONE,
                     whole_turn(pass) ? turn_ms : part_ms);
    alignment_enter(a, STAGE_PASS);
}

/*
 * Whether magnets turned with the field: their EMF is half of the difference of v_q between both directions, less the inductive
 * part. Resistance and dead time cancel.
 */
static bool magnets_turned(const struct alignment *a, const struct tuning *t)
{
    const int32_t n = (int32_t)a->passing.measure_ms;
    const int32_t w_q15 = q15_abs(a->passing.step_q32) / (int32_t)CONFIG_PERIODS_PER_SLOW >> CONFIG_W_SHIFT;
    const int32_t seen_q15 = (a->turn_v_q_q15[PASS_FORWARD] - a->turn_v_q_q15[PASS_BACK]) / n / 2;
    const int32_t emf_q15 = (w_q15 * t->emf_q12) >> 12;
    const int32_t reactive_q15 = tuning_reactive_q15(w_q15, a->target_q15, q15_max(t->x_d_q11, t->x_q_q11));
    return seen_q15 > emf_q15 / 4 + reactive_q15; /* an undamped rotor shows less than half of it */
}

static enum alignment_result judge_fit(struct alignment *a, const struct tuning *t, int32_t two_turns_q4)
{
    const struct encoder_fit fit = encoder_fit(two_turns_q4, t->pole_pairs, t->encoder_counts);
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

/* Both whole turns are done: returns what is wrong with this encoder, if anything. */
static enum alignment_result judge_turns(struct alignment *a, const struct tuning *t)
{
    const int32_t forth_q4 = a->turn_counts_q4[PASS_FORWARD];
    const int32_t back_q4 = -a->turn_counts_q4[PASS_BACK];
    const int32_t expected_q4 = 16 * t->encoder_counts / t->pole_pairs;
    a->detail[0] = forth_q4 / 16;
    a->detail[1] = expected_q4 / 16;
    if (q15_abs(forth_q4) < expected_q4 / SILENT_PART && q15_abs(back_q4) < expected_q4 / SILENT_PART) {
        if (t->reluctant) {
            a->silent = true; /* a locked, very salient rotor has a voltage, too: decided by the axis */
            return ALIGNMENT_RUNNING;
        }
        return magnets_turned(a, t) ? ALIGNMENT_ENCODER_DEAD : ALIGNMENT_BLOCKED;
    }
    if (!a->even || q15_abs(forth_q4 - back_q4) > q15_abs(forth_q4 + back_q4) / EVEN_ONE_IN + 16 * EVEN_COUNTS) {
        return ALIGNMENT_BLOCKED;
    }
    return forth_q4 + back_q4 < 0 ? ALIGNMENT_DIRECTION : judge_fit(a, t, forth_q4 + back_q4);
}

/*
 * At reduced current a rotor may stop following: then the load is too large. One that stuck or oscillated is moved back, so
 * that a second attempt starts at the same position; a falling load is not.
 */
static bool lost_at_reduced_current(struct alignment *a)
{
    const int32_t third_q4 = (a->turn_counts_q4[PASS_FORWARD] - a->turn_counts_q4[PASS_BACK]) / 6;
    const int32_t off_q4 = q15_abs(q15_abs(field_pass_counts_q4(&a->passing)) - third_q4);
    a->lost = off_q4 * (a->attempt == 0u ? 10 : 4) >= third_q4 || (a->lost && a->pass == PASS_BACK_REDUCED);
    return a->lost && (a->pass == PASS_BACK_REDUCED || off_q4 >= third_q4);
}

static void alignment_keep_pass(struct alignment *a)
{
    const uint32_t mean_q32 = field_pass_mean_q32(&a->passing);
    const uint32_t less = whole_turn(a->pass) ? 0u : 1u;
    if ((a->pass & 1u) == 0u) {
        a->load.forward_q32[less] = mean_q32;
    } else {
        a->load.back_q32[less] = mean_q32;
    }
    if (whole_turn(a->pass)) {
        a->turn_counts_q4[a->pass] = field_pass_counts_q4(&a->passing);
        a->turn_v_q_q15[a->pass] = a->passing.sum_v_q_q15;
        a->even = field_pass_even(&a->passing, EVEN_PARTS[a->attempt]) && (a->pass == PASS_FORWARD || a->even);
    }
}

static void begin_solve(struct alignment *a, const struct tuning *t)
{
    a->load.saliency_q15 = t->align[a->level].saliency_q15;
    a->load.ratio_q15 = t->align[a->level].ratio_q15;
    load_angle_start(&a->load);
    alignment_enter(a, STAGE_SOLVE);
}

static bool encoder_fits(const struct alignment *a, const struct tuning *t)
{
    const int32_t two_turns_q4 = q15_abs(a->turn_counts_q4[PASS_FORWARD] - a->turn_counts_q4[PASS_BACK]);
    return encoder_fit(two_turns_q4, t->pole_pairs, t->encoder_counts).verdict == ENCODER_FITS;
}

static enum alignment_result finish_pass(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    enum alignment_result against = ALIGNMENT_RUNNING;
    a->field_q32 = a->passing.field_q32;
    alignment_keep_pass(a);
    if (a->pass == PASS_BACK) {
        against = judge_turns(a, t);
    } else if (!whole_turn(a->pass) && lost_at_reduced_current(a)) {
        a->detail[0] = ALIGNMENT_OUT_DEGREES;
        against = ALIGNMENT_LOAD;
    }
    if (against == ALIGNMENT_DIRECTION && encoder_fits(a, t)) {
        return against; /* evenly a whole turn backwards in both directions: cannot be chance */
    }
    if (against != ALIGNMENT_RUNNING) {
        return alignment_again(a, t, angle_q32, against);
    }
    if (t->reluctant && a->pass == PASS_BACK) {
        alignment_begin_drop(a, true);
    } else if (a->pass == PASS_BACK_REDUCED) {
        begin_solve(a, t);
    } else {
        alignment_begin_pass(a, t, a->pass + 1u);
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

bool load_is_identified(struct alignment *a, const struct tuning *t)
{
    const uint32_t largest_q32 = load_angle_largest_q32(&a->load);
    const int32_t max_q15 = SPREAD_Q15 + (int32_t)(t->encoder_scale_q32 >> COUNT_SHIFT);
    a->detail[0] = (int32_t)(largest_q32 / (DEGREES_45_Q32 / 45));
    return load_angle_spread_q15(&a->load) <= max_q15 && load_angle_uncertainty_q32(&a->load) <= UNCERTAINTY_Q32 &&
           largest_q32 <= (a->attempt == 0u ? DEGREES_12_Q32 : DEGREES_45_Q32);
}

static enum alignment_result step_solve(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    if (!load_angle_step(&a->load)) {
        return ALIGNMENT_RUNNING;
    }
    if (t->shows_axis) {
        alignment_begin_drop(a, true);
        return ALIGNMENT_RUNNING;
    }
    if (!load_is_identified(a, t)) {
        return alignment_again(a, t, angle_q32, ALIGNMENT_LOAD);
    }
    a->target_q15 = 0;
    alignment_enter(a, STAGE_RELEASE);
    return ALIGNMENT_RUNNING;
}

enum alignment_result alignment_step_turns(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                           uint32_t angle_q32)
{
    return a->stage == STAGE_PASS ? step_pass(a, c, t, angle_q32) : step_solve(a, t, angle_q32);
}
