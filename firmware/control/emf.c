/* SPDX-License-Identifier: MIT */
#include "firmware/control/emf.h"

#include "firmware/control/emf_step.h"
#include "lib/polar.h"
#include "lib/q15.h"

#define TURNED_Q15 8780 /* the tangent of 15 degrees */

void emf_reset(struct emf *e, const struct tuning *t)
{
    *e = (struct emf){.lq_q19 = t->x_q_apparent_q11 << 8};
}

void emf_step(struct emf *e, const volatile struct current_loop *c, const struct tuning *t, int32_t rotor_w_q15,
              int32_t frame_w_q15)
{
    emf_step_here(e, c, t, rotor_w_q15, frame_w_q15);
}

/* The possible error of Lq: all of it at first, a quarter once learnt. */
static int32_t unlearnt_q15(const struct emf *e)
{
    return (e->reaction_q15 * (4 * EMF_LEARNT_STEPS - 3 * e->learnt)) / (4 * EMF_LEARNT_STEPS);
}

static enum emf_verdict judge(const struct emf *e, int32_t d_q15, int32_t along_q15, int32_t reaction_q15)
{
    if (along_q15 < -e->unsure_q15 - e->moving_q15) {
        return EMF_REVERSED;
    }
    const int32_t length_q15 = q15_max(along_q15, e->expected_q15 / 2);
    const int32_t allowed_q15 = e->slack_q15 + reaction_q15 + ((length_q15 * TURNED_Q15) >> 15);
    return q15_abs(d_q15) > allowed_q15 ? EMF_TURNED : EMF_AGREES;
}

enum emf_verdict emf_judge(const struct emf *e, bool backwards)
{
    return judge(e, e->filtered.d_q15, backwards ? -e->filtered.q_q15 : e->filtered.q_q15, unlearnt_q15(e));
}

enum emf_verdict emf_judge_change(const struct emf *e, const struct emf_vector *before, bool backwards)
{
    return judge(e, e->now.d_q15 - before->d_q15, backwards ? -e->now.q_q15 : e->now.q_q15, e->reaction_q15 / 4);
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
