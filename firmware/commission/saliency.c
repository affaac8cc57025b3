/* SPDX-License-Identifier: MIT */
#include "firmware/commission/saliency.h"

#include <stddef.h>

#include "firmware/settings/config.h"
#include "lib/pi.h"
#include "lib/polar.h"
#include "lib/q15.h"
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

static int32_t integral_q9(const volatile struct current_loop *c, int32_t v_q15)
{
    const int32_t v_steps = v_q15 * (CONFIG_BUS_STEPS / 16) / (c->vbus_q15 / 16 + 1);
    return q15_clamp(v_steps, -LOOP_V_D_MAX_STEPS / 2, LOOP_V_D_MAX_STEPS / 2) * (1 << PI_SHIFT);
}

static void hold_voltage(const struct saliency *s, volatile struct current_loop *c, int32_t v_q15)
{
    current_loop_field(c, s->angle * STEP_Q32, 0);
    c->integral_q_q9 = integral_q9(c, s->steady_q_q15);
    c->integral_d_q9 = integral_q9(c, s->steady_d_q15 + v_q15);
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

/* This angle's part of the sums, relative to the encoder. */
static void keep(struct saliency *s, uint32_t encoder_q32)
{
    const cossin_t twice = cossin_q15(2u * (s->angle * STEP_Q32 - encoder_q32));
    s->sum_re_q15 += (s->response_d_q15 * twice.cos - s->response_q_q15 * twice.sin) >> 15;
    s->sum_im_q15 += (s->response_d_q15 * twice.sin + s->response_q_q15 * twice.cos) >> 15;
    s->sum_straight_q15 += s->response_d_q15;
    s->response_d_q15 = 0;
    s->response_q_q15 = 0;
    s->angle++;
    s->ms = 0;
}

bool saliency_step(struct saliency *s, volatile struct current_loop *c, uint32_t encoder_q32)
{
    if (s->angle == SALIENCY_ANGLES) {
        c->integral_d_q9 = 0;
        c->integral_q_q9 = 0;
        return true;
    }
    const int32_t sign = (s->angle & 1u) == 0u ? 1 : -1;
    if (s->ms == 0u) {
        take_away(s, c);
    }
    s->response_d_q15 += sign * WEIGHTS[s->ms] * c->i_d_q15 / 8;
    s->response_q_q15 += sign * WEIGHTS[s->ms] * c->i_q_q15 / 8;
    hold_voltage(s, c, sign * HALVES[s->ms] * s->v_q15 / 2);
    s->ms++;
    if (s->ms == PATTERN_MS) {
        keep(s, encoder_q32);
    }
    return false;
}

uint32_t saliency_offset_q32(const struct saliency *s)
{
    return atan2_q32(s->sum_im_q15, s->sum_re_q15) / 2u;
}

bool saliency_seen(const struct saliency *s)
{
    return q15_max(q15_abs(s->sum_re_q15), q15_abs(s->sum_im_q15)) * 10 > q15_abs(s->sum_straight_q15);
}
