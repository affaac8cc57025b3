/* SPDX-License-Identifier: MIT */
/* What the thread does a part at a time, for tests of what comes of it: at once. */
#include "at_once.h"

void torque_map_build(struct torque_map *map, const struct params *p, const struct tuning *t)
{
    struct torque_map_builder builder;
    torque_map_build_begin(&builder, map, p, t);
    while (torque_map_build_step(&builder, map, p, t)) {
    }
}

void weakening_build(struct weakening *w, const struct torque_map *map, const struct params *p, const struct tuning *t,
                     int32_t v_d_max_steps)
{
    struct weakening_builder builder;
    weakening_build_begin(&builder, w, map, p, t, v_d_max_steps);
    while (weakening_build_step(&builder, w, map)) {
    }
}

void torque_build(struct torque_control *s, const struct params *p, struct tuning *t, int32_t vbus_q15)
{
    struct torque_builder builder;
    torque_build_begin(&builder, s, p, t, vbus_q15);
    while (torque_build_step(&builder, s, p, t)) {
    }
}
