/* SPDX-License-Identifier: MIT */
/* The rotor is pulled to two angles of the field; which way its encoder counts shows on the way. */
#include "firmware/commission/alignment_parts.h"
#include "lib/q15.h"

#define JUMP_MS        8u /* for a quarter turn: a rotor opposite to the field must not meet it half way */
#define SETTLE_PERIODS 10
#define SETTLE_MS      60
#define SLOWER         4 /* times, at the second attempt */
#define GRIP_TENTHS    3 /* of a turn */
#define GRIP_MS        5
#define AWAY_TURNS     3 /* further from where it began no field pulls the rotor */
#define SENSE_STEP     4096
#define FAST_COUNTS    4
#define FAST_Q32       (DEGREES_45_Q32 / 9)

/* The first attempt is quick; the second has time for 16 times the inertia that was told, and as much current as there is. */
void alignment_begin_attempt(struct alignment *a, const struct tuning *t, uint32_t attempt, uint32_t angle_q32)
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
    alignment_enter(a, STAGE_PULL);
    if (t->reluctant) {
        alignment_begin_drop(a, false);
    }
}

/* Nothing is said against the motor or its wiring that a second attempt does not confirm. */
enum alignment_result alignment_again(struct alignment *a, const struct tuning *t, uint32_t angle_q32,
                                      enum alignment_result otherwise)
{
    if (a->attempt + 1u >= ALIGNMENT_ATTEMPTS) {
        return otherwise;
    }
    alignment_begin_attempt(a, t, a->attempt + 1u, angle_q32);
    return ALIGNMENT_RUNNING;
}

/*
 * Which way the encoder counts. Magnets that move induce a q voltage in the sense of their motion while they are within 90
 * degrees of the field. There they are as a rotor that swings begins to slow down; and at the latest when it has turned by a
 * third of a turn. Until then nothing is damped, for damping in the wrong sense would drive the rotor. Where reluctance holds
 * the rotor the voltage's sense changes beyond 45 degrees from the hold, and the sum of all the way counts.
 */
void alignment_feel_sense(struct alignment *a, const volatile struct current_loop *c, const struct tuning *t,
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
void alignment_follow_current(struct alignment *a, const struct tuning *t)
{
    const int32_t half_ms = a->gripped || t->reluctant ? GRIP_MS : a->period_ms / 2;
    const int32_t slope_q15 = q15_max(t->align[a->level].i_q15 / half_ms, 1);
    a->current_q15 += q15_clamp(a->target_q15 - a->current_q15, -slope_q15, slope_q15);
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
bool alignment_carried_away(struct alignment *a, const struct tuning *t)
{
    const int32_t turns = a->stage < STAGE_PASS ? AWAY_TURNS : ALIGNMENT_TURNS;
    grip(a, t);
    return q15_abs(a->counts - a->origin) > turns * t->encoder_counts / t->pole_pairs;
}

/* Settled, or waited long enough. */
static bool at_rest(const struct alignment *a)
{
    return a->current_q15 == a->target_q15 &&
           (pendulum_settled(&a->rotor) || (int32_t)a->stage_ms >= a->period_ms * SETTLE_PERIODS + SETTLE_MS);
}

static enum alignment_result step_first(struct alignment *a, const struct tuning *t)
{
    if (at_rest(a) && t->reluctant && !alignment_leads_the_field(a)) {
        alignment_begin_pass(a, t, PASS_FORTH);
    } else if (at_rest(a)) {
        alignment_enter(a, STAGE_SECOND);
    }
    return ALIGNMENT_RUNNING;
}

static enum alignment_result step_second(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    if (a->stage_ms <= JUMP_MS) {
        a->field_q32 += QUARTER_Q32 / JUMP_MS;
        pendulum_start(&a->rotor, a->rotor.period_ms, angle_q32, a->field_q32);
    } else if (at_rest(a)) {
        alignment_begin_pass(a, t, PASS_FORTH);
    }
    return ALIGNMENT_RUNNING;
}

enum alignment_result alignment_step_pull(struct alignment *a, const struct tuning *t, uint32_t angle_q32)
{
    return a->stage == STAGE_PULL ? step_first(a, t) : step_second(a, t, angle_q32);
}
