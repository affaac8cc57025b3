/* SPDX-License-Identifier: MIT */
#include "firmware/commission/alignment.h"

#include "firmware/commission/alignment_parts.h"
#include "lib/q15.h"

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

/* The counter runs from 0 to one turn; between two steps it moves by less than half a turn. Returns the difference. */
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

/* The current is gone: from now on the offset does not change. */
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

static enum alignment_result step_stage(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                        uint32_t angle_q32)
{
    if (a->stage < STAGE_PASS) {
        return alignment_step_pull(a, t, angle_q32);
    }
    if (a->stage < STAGE_RELEASE) {
        return alignment_step_turns(a, c, t, angle_q32);
    }
    return a->stage == STAGE_RELEASE ? step_release(a, c) : alignment_step_reluctant(a, c, t, angle_q32);
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
    pull_speed_step(&a->speed, c, t, (int32_t)encoder_q32(c, (uint32_t)moved));
    alignment_feel_sense(a, c, t, moved, angle_q32);
    alignment_follow_current(a, t);
    if (alignment_carried_away(a, t)) {
        a->detail[0] = ALIGNMENT_OUT_DEGREES;
        return ALIGNMENT_LOAD;
    }
    if (a->stage < STAGE_DROP && a->stage != STAGE_PASS) {
        pendulum_step(&a->rotor, c, angle_q32, a->field_q32, 0, alignment_pull_current_q15(a, t));
    }
    return step_stage(a, c, t, angle_q32);
}
