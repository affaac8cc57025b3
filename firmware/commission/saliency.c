/* SPDX-License-Identifier: MIT */
#include "firmware/commission/saliency.h"

#include <stddef.h>

#include "firmware/settings/config.h"
#include "lib/trig.h"

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
        c->integral_d_q9 = 0;
        c->integral_q_q9 = 0;
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
