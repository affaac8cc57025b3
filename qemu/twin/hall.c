/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE
#include "hall.h"

#include <math.h>

#define HALF_RAD  3.1415926535897932
#define THIRD_RAD 2.0943951023931953

void hall_init(struct hall *h, const struct sensor_params *p)
{
    const double error_rad[3] = {p->hall_error_a_rad, p->hall_error_b_rad, p->hall_error_c_rad};
    *h = (struct hall){.hysteresis_rad = p->hall_hysteresis_rad, .sin_hysteresis = sin(p->hall_hysteresis_rad)};
    for (int k = 0; k < 3; k++) {
        sincos(p->hall_angle_rad + k * THIRD_RAD + error_rad[k], &h->sin_rise[k], &h->cos_rise[k]);
        h->on_wire[k] = k;
    }
}

/* A switch keeps what it shows while the field is weaker than its thresholds. */
bool hall_follow(struct hall *h, double electrical_rad)
{
    double s, c;
    unsigned before = h->switches;
    sincos(electrical_rad, &s, &c);
    for (int k = 0; k < 3; k++) {
        double field = s * h->cos_rise[k] - c * h->sin_rise[k];
        if (field >= h->sin_hysteresis) {
            h->switches |= 1u << k;
        } else if (field < -h->sin_hysteresis) {
            h->switches &= ~(1u << k);
        }
    }
    return h->switches != before;
}

unsigned hall_wires(const struct hall *h)
{
    unsigned wires = 0;
    for (int k = 0; k < 3; k++) {
        wires |= (h->switches >> h->on_wire[k] & 1u) << k;
    }
    return (wires ^ h->inverted) | h->open;
}

double hall_since_rad(const struct hall *h, double electrical_rad, bool forwards)
{
    double s, c, nearest = HALF_RAD;
    sincos(electrical_rad + (forwards ? -h->hysteresis_rad : h->hysteresis_rad), &s, &c);
    for (int k = 0; k < 3; k++) {
        /* from the switch's last edge, which comes twice a turn */
        double past = atan2(s * h->cos_rise[k] - c * h->sin_rise[k], c * h->cos_rise[k] + s * h->sin_rise[k]);
        past = past < 0 ? past + HALF_RAD : past;
        nearest = fmin(nearest, forwards ? past : HALF_RAD - past);
    }
    return forwards ? nearest : -nearest;
}

static void set(unsigned *wires, int wire, bool on)
{
    *wires = on ? *wires | 1u << wire : *wires & ~(1u << wire);
}

void hall_open_wire(struct hall *h, int wire, bool open)
{
    set(&h->open, wire, open);
}

void hall_invert_wire(struct hall *h, int wire, bool inverted)
{
    set(&h->inverted, wire, inverted);
}

void hall_swap_wires(struct hall *h, int wire, int other)
{
    for (int k = 0; k < 3; k++) {
        h->on_wire[k] = k;
    }
    h->on_wire[wire] = other;
    h->on_wire[other] = wire;
}
