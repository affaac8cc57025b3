/* SPDX-License-Identifier: MIT */
/* A second attempt, before anything is said against the motor or its wiring. */
#include "firmware/commission/alignment_parts.h"

#define SLOWER 4 /* times, at the second attempt */

void alignment_begin_drop(struct alignment *a, bool turned)
{
    a->turned = turned;
    a->target_q15 = 0;
    a->current_q15 = 0;
    a->still_ms = 0;
    alignment_enter(a, STAGE_DROP);
}

/* The first attempt is quick; the second allows for 16 times the inertia parameter, and uses all the current. */
void alignment_begin_attempt(struct alignment *a, const struct tuning *t, uint32_t attempt, uint32_t angle_q32)
{
    a->attempt = attempt;
    a->level = attempt == 0u ? 0u : t->align_levels - 1u;
    a->period_ms = attempt == 0u ? t->align[a->level].period_ms : t->align[a->level].period_ms * SLOWER;
    a->origin = a->counts;
    a->silent = false;
    encoder_sense_start(&a->turned_with);
    alignment_begin_swing(a);
    a->gripped = false;
    a->ratio = RATIO_ONE;
    a->target_q15 = t->align[a->level].i_q15;
    pendulum_start(&a->rotor, t->align[a->level].period_ms, angle_q32, a->field_q32);
    alignment_enter(a, STAGE_PULL);
    if (t->reluctant) {
        alignment_begin_drop(a, false);
    }
}

/* Reports nothing against the motor or its wiring that a second attempt does not confirm. */
enum alignment_result alignment_again(struct alignment *a, const struct tuning *t, uint32_t angle_q32,
                                      enum alignment_result otherwise)
{
    if (a->attempt + 1u >= ALIGNMENT_ATTEMPTS) {
        return otherwise;
    }
    alignment_begin_attempt(a, t, a->attempt + 1u, angle_q32);
    return ALIGNMENT_RUNNING;
}
