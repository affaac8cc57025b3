/* SPDX-License-Identifier: MIT */
#include "firmware/control/torque_build.h"

#include "firmware/control/current_loop.h"
#include "firmware/control/stage_weaken.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "lib/q15.h"

/* Whether rated torque at speed_max needs currents beyond the ordinary handlers at the present bus voltage. */
static bool needs_weakening(const struct torque_control *s, const struct params *p, const struct tuning *t,
                            int32_t vbus_q15)
{
    const int32_t rated_q15 = q15_min(tuning_q15_from_milli(p->i_rated_ma, p->i_range_ma), t->i_max_q15);
    const int32_t w_q15 = (int32_t)((int64_t)p->speed_max_rpm * t->overspeed_w_q15 / p->overspeed_rpm);
    const int32_t flux_q15 = flux_limit_at(vbus_q15, q15_max(w_q15, 1));
    const struct weakening_row row = weakening_row(&s->weakening, flux_q15);
    return flux_q15 < s->weakening.top_q15 &&
           weakening_torque(&row, t->i_max_q15) < torque_map_reach(&s->map, s->map.current_q15, rated_q15);
}

/* The table for the ordinary handlers is finished: whether another one is needed. */
static bool begin_again(struct torque_builder *b, struct torque_control *s, const struct params *p, struct tuning *t)
{
    const bool needed =
        p->angle_source == PARAM_ANGLE_ENCODER && (p->overmodulation != 0 || needs_weakening(s, p, t, b->vbus_q15));
    t->weakens = FEATURE_IN(WEAKENING) && needed;
    b->lacks_weakening = needed && !t->weakens;
    if (t->weakens) {
        t->radius_steps = CONFIG_RADIUS_STEPS + (CONFIG_SIX_STEPS - CONFIG_RADIUS_STEPS) * p->overmodulation / 100;
        weakening_build_begin(&b->weakening, &s->weakening, &s->map, p, t, WEAKEN_D_MAX_STEPS(CONFIG_RADIUS_STEPS));
    }
    return t->weakens;
}

void torque_build_begin(struct torque_builder *b, struct torque_control *s, const struct params *p,
                        const struct tuning *t, int32_t vbus_q15)
{
    b->part = TORQUE_BUILDS_MAP;
    b->vbus_q15 = vbus_q15;
    b->lacks_weakening = false;
    torque_map_build_begin(&b->map, &s->map, p, t);
}

bool torque_build_step(struct torque_builder *b, struct torque_control *s, const struct params *p, struct tuning *t)
{
    if (b->part == TORQUE_BUILDS_MAP) {
        if (!torque_map_build_step(&b->map, &s->map, p, t)) {
            b->part = TORQUE_BUILDS_ORDINARY;
            weakening_build_begin(&b->weakening, &s->weakening, &s->map, p, t, LOOP_V_D_MAX_STEPS);
        }
        return true;
    }
    if (weakening_build_step(&b->weakening, &s->weakening, &s->map)) {
        return true;
    }
    const bool ordinary = b->part == TORQUE_BUILDS_ORDINARY;
    b->part = TORQUE_BUILDS_WEAKENING;
    flux_limit_reset(&s->flux);
    return ordinary && begin_again(b, s, p, t);
}
