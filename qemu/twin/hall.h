/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Three Hall switches 120 electrical degrees apart. Switch k (A, B, C: bits 0, 1, 2) is 1 over the half turn that follows
 *
 *   theta_e = hall_angle_rad + k 2 pi / 3 + hall_error_k_rad */
#ifndef TWIN_HALL_H
#define TWIN_HALL_H

#include <stdbool.h>

#include "sensor_keys.h"

struct hall {
    double sin_rise[3], cos_rise[3]; /* of those angles */
};

void hall_init(struct hall *h, const struct sensor_params *p);
unsigned hall_state(const struct hall *h, double electrical_rad);
/* How far the shaft has turned since the last switch changed, within half a turn; negative: backwards. */
double hall_since_rad(const struct hall *h, double electrical_rad, bool forwards);

#endif
