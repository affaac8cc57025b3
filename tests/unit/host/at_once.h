/* SPDX-License-Identifier: MIT */
#ifndef AT_ONCE_H
#define AT_ONCE_H

#include "firmware/control/torque_build.h"

void torque_map_build(struct torque_map *map, const struct params *p, const struct tuning *t);
void weakening_build(struct weakening *w, const struct torque_map *map, const struct params *p, const struct tuning *t,
                     int32_t v_d_max_steps);
void torque_build(struct torque_control *s, const struct params *p, struct tuning *t, int32_t vbus_q15);

#endif
