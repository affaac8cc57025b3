/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE
#include "hall.h"

#include <math.h>

#define HALF_RAD  3.1415926535897932
#define THIRD_RAD 2.0943951023931953

void hall_init(struct hall *h, const struct sensor_params *p)
{
    const double error_rad[3] = {p->hall_error_a_rad, p->hall_error_b_rad, p->hall_error_c_rad};
    for (int k = 0; k < 3; k++) {
        sincos(p->hall_angle_rad + k * THIRD_RAD + error_rad[k], &h->sin_rise[k], &h->cos_rise[k]);
    }
}

unsigned hall_state(const struct hall *h, double electrical_rad)
{
    double s, c;
    unsigned state = 0;
    sincos(electrical_rad, &s, &c);
    for (int k = 0; k < 3; k++) {
        state |= s * h->cos_rise[k] - c * h->sin_rise[k] >= 0 ? 1u << k : 0u;
    }
    return state;
}

double hall_since_rad(const struct hall *h, double electrical_rad, bool forwards)
{
    double s, c, nearest = HALF_RAD;
    sincos(electrical_rad, &s, &c);
    for (int k = 0; k < 3; k++) {
        /* from the switch's last edge, which comes twice a turn */
        double past = atan2(s * h->cos_rise[k] - c * h->sin_rise[k], c * h->cos_rise[k] + s * h->sin_rise[k]);
        past = past < 0 ? past + HALF_RAD : past;
        nearest = fmin(nearest, forwards ? past : HALF_RAD - past);
    }
    return forwards ? nearest : -nearest;
}
