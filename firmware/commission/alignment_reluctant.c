/* SPDX-License-Identifier: MIT */
/* Where reluctance outweighs the magnets: their axis is measured before the rotor is pulled, and again after it has turned. */
#include "firmware/commission/alignment_parts.h"
#include "lib/q15.h"

#define STILL_MS       12u
#define STILL_MOST_MS  2000u
#define AXIS_APART_Q32 (DEGREES_45_Q32 / 9 * 2)
#define NORTH_Q32      (DEGREES_45_Q32 / 9 * 16) /* 80 degrees */

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

/*
 * Reluctance holds the rotor behind the field or ahead of it. If ahead, friction would drag it to the other side as the field
 * begins to turn; a quarter turn of the field does that at rest.
 */
bool alignment_leads_the_field(const struct alignment *a)
{
    return (a->counts - a->origin) * a->rotor.sense < 0;
}

static enum alignment_result step_drop(struct alignment *a, volatile struct current_loop *c, const struct tuning *t)
{
    c->i_d_ref_q15 = 0;
    current_loop_field(c, a->field_q32, 0);
    if (a->still_ms >= STILL_MS) {
        saliency_start(&a->axis, t->saliency_v_q15, t->saliency_i_q15);
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
        return alignment_again(a, t, angle_q32, apart ? ALIGNMENT_ENCODER_DEAD : ALIGNMENT_BLOCKED);
    }
    if (apart) {
        return alignment_again(a, t, angle_q32, ALIGNMENT_BLOCKED);
    }
    if (q15_abs((int32_t)(a->load.back_q32[0] - offset_q32) / 2) > (int32_t)(QUARTER_Q32 / 2)) {
        offset_q32 += 2u * QUARTER_Q32;
    }
    const int32_t forth_q32 = q15_abs((int32_t)(a->load.forth_q32[0] - offset_q32) / 2);
    const int32_t back_q32 = q15_abs((int32_t)(a->load.back_q32[0] - offset_q32) / 2);
    const int32_t most_q32 = q15_max(forth_q32, back_q32);
    if (most_q32 > NORTH_Q32 / 2) {
        a->detail[0] = most_q32 / (DEGREES_45_Q32 / 90);
        return alignment_again(a, t, angle_q32, ALIGNMENT_LOAD);
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

enum alignment_result alignment_step_reluctant(struct alignment *a, volatile struct current_loop *c,
                                               const struct tuning *t, uint32_t angle_q32)
{
    return a->stage == STAGE_DROP ? step_drop(a, c, t) : step_axis(a, c, t, angle_q32);
}
