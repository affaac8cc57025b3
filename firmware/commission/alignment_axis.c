/* SPDX-License-Identifier: MIT */
/*
 * The magnets' axis, measured without current once the rotor rests. Where reluctance outweighs the magnets that is done before
 * the rotor is pulled, and again after it has turned; in other salient machines after it has turned.
 */
#include <stddef.h>

#include "firmware/commission/alignment.h"
#include "firmware/commission/alignment_parts.h"
#include "firmware/settings/config.h"
#include "lib/angle.h"
#include "lib/q15.h"
#include "lib/trig.h"

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
#define STILL_MOST_MS  2000u
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
    } else if (a->stage_ms > STILL_MOST_MS) {
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
                                         uint32_t angle_q32, uint32_t offset_q32, uint32_t most_q32)
{
    const int32_t forth_q32 = (int32_t)(a->load.forth_q32[0] - offset_q32);
    const int32_t back_q32 = (int32_t)(a->load.back_q32[0] - offset_q32);
    const uint32_t mean_q32 = angle_size_q32(forth_q32 / 2 + back_q32 / 2);
    const uint32_t away_q32 = mean_q32 + angle_size_q32(forth_q32 / 2 - back_q32 / 2);
    if (mean_q32 > most_q32 || away_q32 > most_q32 + RUBBING_Q32) {
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
    if (!alignment_load_is_told(a, t)) {
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
