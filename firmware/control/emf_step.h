/* SPDX-License-Identifier: MIT */
/* One sample of the EMF (emf.h), inlined into its caller. Slow loop. */
#ifndef FIRMWARE_CONTROL_EMF_STEP_H
#define FIRMWARE_CONTROL_EMF_STEP_H

#include "firmware/control/emf.h"
#include "lib/advance.h"
#include "lib/q15.h"

#define EMF_FILTER_SHIFT    1 /* of the filtered vector: two steps */
#define EMF_DEAD_TIME_SHIFT 6 /* a dead time of 1 us at 20 kHz costs 2 % of the bus; most of it is compensated */
#define EMF_LEARN_SHIFT     7 /* a 128th of Lq a step */
#define EMF_LARGEST_Q15     131071
#define EMF_MILLISECOND_Q15 4172 /* from reactance at the base speed to L over 1 ms: 1000 / (2 pi 1250) */

/*
 * While the encoder is right and current flows in q, the remaining d component is the error of Lq: Lq moves in small steps
 * until it vanishes, within a quarter and four times the parameter.
 */
static inline void emf_learn(struct emf *e, const struct tuning *t, int32_t reaction_q15)
{
    const int32_t told_q19 = t->x_q_apparent_q11 << 8;
    const int32_t step_q19 = told_q19 >> EMF_LEARN_SHIFT;
    const bool too_small = (e->filtered.d_q15 < 0) == (reaction_q15 > 0);
    e->lq_q19 = q15_clamp(e->lq_q19 + (too_small ? step_q19 : -step_q19), told_q19 / 4, told_q19 * 4);
    e->learnt = q15_min(e->learnt + 1, EMF_LEARNT_STEPS);
}

static inline int32_t emf_limited(int32_t e_q15)
{
    return q15_clamp(e_q15, -EMF_LARGEST_Q15, EMF_LARGEST_Q15);
}

/* Lq i, a voltage at the base speed: the product has up to 35 bits. */
static inline int32_t emf_inductive(const struct emf *e, int32_t i_q15)
{
    return emf_limited((int32_t)(((int64_t)i_q15 * (e->lq_q19 >> 8)) >> 11));
}

static inline int32_t emf_reaction(const struct emf *e, int32_t w_q15, int32_t i_q15)
{
    return emf_inductive(e, (w_q15 * i_q15) >> 15);
}

/* Uncertainty of the parameters: see struct emf. */
static inline void emf_allow(struct emf *e, const struct tuning *t, const struct emf_vector *i, int32_t moved_q15,
                             int32_t dead_q15)
{
    const int32_t both_q15 = (q15_abs(i->d_q15) + q15_abs(i->q_q15)) / 2;
    const int32_t step_q15 = emf_inductive(e, moved_q15);
    e->unsure_q15 = ((t->r_q12 * both_q15) >> 12) + dead_q15;
    e->moving_q15 = (q15_min(step_q15, Q15_ONE) * EMF_MILLISECOND_Q15) >> 15;
    e->slack_q15 = ((t->r_q12 * q15_abs(i->d_q15)) >> 12) + dead_q15 + e->moving_q15;
}

static inline __attribute__((always_inline)) void emf_step_here(struct emf *e, const volatile struct current_loop *c,
                                                                const struct tuning *t, int32_t rotor_w_q15,
                                                                int32_t frame_w_q15)
{
    struct emf_vector v = {c->v_d_q15, c->v_q_q15};
    const struct emf_vector i = {c->i_d_q15, c->i_q_q15};
    const int32_t reaction_q15 = emf_reaction(e, frame_w_q15, i.q_q15);
    advance_q15(&v.d_q15, &v.q_q15,
                -c->v_turn_q15); /* from the rotor's frame at the sample to its frame when the voltage acts */
    e->now.d_q15 = emf_limited(v.d_q15 - ((t->r_q12 * i.d_q15) >> 12) + reaction_q15);
    e->now.q_q15 = emf_limited(v.q_q15 - ((t->r_q12 * i.q_q15) >> 12) - emf_reaction(e, frame_w_q15, i.d_q15));
    e->filtered.d_q15 += (e->now.d_q15 - e->filtered.d_q15) >> EMF_FILTER_SHIFT;
    e->filtered.q_q15 += (e->now.q_q15 - e->filtered.q_q15) >> EMF_FILTER_SHIFT;

    const int32_t moved_q15 = q15_abs(i.q_q15 - e->i_q_q15);
    e->i_q_q15 = i.q_q15;
    e->expected_q15 = (q15_abs(rotor_w_q15) * t->emf_q12) >> 12;
    e->reaction_q15 = q15_abs(reaction_q15);
    emf_allow(e, t, &i, moved_q15, c->vbus_q15 >> EMF_DEAD_TIME_SHIFT);
    if (e->reaction_q15 > e->expected_q15 >> 4 && moved_q15 < q15_abs(i.q_q15) >> 2) {
        emf_learn(e, t, reaction_q15);
    }
}

#endif
