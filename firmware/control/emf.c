/* SPDX-License-Identifier: MIT */
#include "firmware/control/emf.h"

#include "lib/advance.h"
#include "lib/polar.h"
#include "lib/q15.h"

#define FILTER_SHIFT  1 /* of the filtered vector: two steps */
#define FILTER_COARSE 4
#define COUNT_FINE_Q32 \
    (UINT32_MAX / 128u)    /* an encoder count of 2.8 degrees, electrical: up to this the filter is the shortest */
#define DEAD_TIME_SHIFT  6 /* a dead time of 1 us at 20 kHz costs 2 % of the bus; most of it is compensated */
#define LEARN_SHIFT      7 /* a 128th of Lq a step */
#define MAX_Q15          131071
#define MILLISECOND_Q15  4172    /* from reactance at the base speed to L over 1 ms: 1000 / (2 pi 1250) */
#define TURNED_Q15       8780    /* the tangent of 15 degrees */
#define TURN_RADIANS_Q15 205887u /* 2 pi */

void emf_reset(struct emf *e, const struct tuning *t)
{
    *e = (struct emf){.lq_q19 = t->x_q_apparent_q11 << 8, .filter_shift = FILTER_SHIFT, .turned_q15 = TURNED_Q15};
}

void emf_set_count(struct emf *e, uint32_t count_q32)
{
    while (e->filter_shift < FILTER_COARSE && count_q32 > COUNT_FINE_Q32 << (e->filter_shift - FILTER_SHIFT)) {
        e->filter_shift++;
    }
    e->turned_q15 += (int32_t)(((uint64_t)count_q32 * TURN_RADIANS_Q15) >> 32);
}

/*
 * With a correct angle and q current, the remaining d component is due to an error of Lq: Lq is adapted in small steps until it
 * vanishes, within a quarter and four times the parameter.
 */
static void learn_lq(struct emf *e, const struct tuning *t, int32_t reaction_q15)
{
    const int32_t nominal_q19 = t->x_q_apparent_q11 << 8;
    const int32_t step_q19 = nominal_q19 >> LEARN_SHIFT;
    const bool too_small = (e->filtered.d_q15 < 0) == (reaction_q15 > 0);
    e->lq_q19 = q15_clamp(e->lq_q19 + (too_small ? step_q19 : -step_q19), nominal_q19 / 4, nominal_q19 * 4);
    e->learnt = q15_min(e->learnt + 1, EMF_LEARNT_STEPS);
}

static int32_t limited_q15(int32_t e_q15)
{
    return q15_clamp(e_q15, -MAX_Q15, MAX_Q15);
}

/* Lq i, a voltage at the base speed: the product has up to 35 bits. */
static int32_t inductive_q15(const struct emf *e, int32_t i_q15)
{
    return limited_q15((int32_t)(((int64_t)i_q15 * (e->lq_q19 >> 8)) >> 11));
}

static int32_t reaction_of(const struct emf *e, int32_t w_q15, int32_t i_q15)
{
    return inductive_q15(e, (w_q15 * i_q15) >> 15);
}

/* Uncertainty of the parameters: see struct emf. */
static void allow(struct emf *e, const struct tuning *t, const struct emf_vector *i, int32_t moved_q15,
                  int32_t dead_q15)
{
    const int32_t both_q15 = (q15_abs(i->d_q15) + q15_abs(i->q_q15)) / 2;
    const int32_t step_q15 = inductive_q15(e, moved_q15);
    e->uncertain_q15 = ((t->r_q12 * both_q15) >> 12) + dead_q15;
    e->moving_q15 = (q15_min(step_q15, Q15_ONE) * MILLISECOND_Q15) >> 15;
    e->tolerance_q15 = ((t->r_q12 * q15_abs(i->d_q15)) >> 12) + dead_q15 + e->moving_q15;
}

void emf_step(struct emf *e, const volatile struct current_loop *c, const struct tuning *t, int32_t rotor_w_q15,
              int32_t frame_w_q15)
{
    struct emf_vector v = {c->v_d_q15, c->v_q_q15};
    const struct emf_vector i = {c->i_d_q15, c->i_q_q15};
    const int32_t reaction_q15 = reaction_of(e, frame_w_q15, i.q_q15);
    advance_q15(&v.d_q15, &v.q_q15,
                -c->v_turn_q15); /* from the rotor's frame at the sample to its frame when the voltage acts */
    e->now.d_q15 = limited_q15(v.d_q15 - ((t->r_q12 * i.d_q15) >> 12) + reaction_q15);
    e->now.q_q15 = limited_q15(v.q_q15 - ((t->r_q12 * i.q_q15) >> 12) - reaction_of(e, frame_w_q15, i.d_q15));
    e->filtered.d_q15 += (e->now.d_q15 - e->filtered.d_q15) >> e->filter_shift;
    e->filtered.q_q15 += (e->now.q_q15 - e->filtered.q_q15) >> e->filter_shift;

    const int32_t moved_q15 = q15_abs(i.q_q15 - e->i_q_q15);
    e->i_q_q15 = i.q_q15;
    e->expected_q15 = (q15_abs(rotor_w_q15) * t->emf_q12) >> 12;
    e->reaction_q15 = q15_abs(reaction_q15);
    allow(e, t, &i, moved_q15, c->vbus_q15 >> DEAD_TIME_SHIFT);
    if (e->reaction_q15 > e->expected_q15 >> 4 && moved_q15 < q15_abs(i.q_q15) >> 2) {
        learn_lq(e, t, reaction_q15);
    }
}

/* The possible error of Lq: all of it at first, a quarter once learnt. */
static int32_t unlearnt_q15(const struct emf *e)
{
    return (e->reaction_q15 * (4 * EMF_LEARNT_STEPS - 3 * e->learnt)) / (4 * EMF_LEARNT_STEPS);
}

static enum emf_verdict verdict_of(const struct emf *e, int32_t d_q15, int32_t along_q15, int32_t reaction_q15)
{
    if (along_q15 < -e->uncertain_q15 - e->moving_q15) {
        return EMF_REVERSED;
    }
    const int32_t length_q15 = q15_max(along_q15, e->expected_q15 / 2);
    const int32_t allowed_q15 = e->tolerance_q15 + reaction_q15 + ((length_q15 * e->turned_q15) >> 15);
    return q15_abs(d_q15) > allowed_q15 ? EMF_TURNED : EMF_AGREES;
}

enum emf_verdict emf_judge(const struct emf *e, bool backwards)
{
    return verdict_of(e, e->filtered.d_q15, backwards ? -e->filtered.q_q15 : e->filtered.q_q15, unlearnt_q15(e));
}

enum emf_verdict emf_judge_change(const struct emf *e, const struct emf_vector *before, bool backwards)
{
    return verdict_of(e, e->now.d_q15 - before->d_q15, backwards ? -e->now.q_q15 : e->now.q_q15, e->reaction_q15 / 4);
}

uint32_t emf_angle_q32(const struct emf_vector *v, bool backwards)
{
    const int32_t along_q15 = backwards ? -v->q_q15 : v->q_q15;
    const int32_t across_q15 = backwards ? v->d_q15 : -v->d_q15;
    return atan2_q32(across_q15, along_q15);
}

int32_t emf_angle_deg(const struct emf_vector *v, bool backwards)
{
    return (int32_t)(int16_t)((emf_angle_q32(v, backwards) + 0x8000u) >> 16) * 360 / 65536;
}
