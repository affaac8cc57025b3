/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Three Hall switches 120 electrical degrees apart, and the wires that bring them to the fabric. Switch k (A, B, C: bits 0, 1,
 * 2) is 1 over the half turn that follows
 *
 *   theta_e = hall_angle_rad + k 2 pi / 3 + hall_error_k_rad
 *
 * and both of its edges come hall_hysteresis_rad late, whichever way it turns. An open wire reads 1: the fabric's inputs are
 * pulled up. */
#ifndef TWIN_HALL_H
#define TWIN_HALL_H

#include <stdbool.h>

#include "sensor_keys.h"

struct hall {
    double sin_rise[3], cos_rise[3]; /* of those angles */
    double hysteresis_rad, sin_hysteresis;
    unsigned switches; /* as they are */
    int on_wire[3];    /* which switch is on wire A, B, C */
    unsigned open;     /* wires */
    unsigned inverted; /* wires */
};

void hall_init(struct hall *h, const struct sensor_params *p);
/* The shaft has come here: what the switches show; returns whether one has changed. */
bool hall_follow(struct hall *h, double electrical_rad);
/* What the fabric sees of it. */
unsigned hall_wires(const struct hall *h);
/* How far the shaft has turned since the last switch changed, within half a turn; negative: backwards. */
double hall_since_rad(const struct hall *h, double electrical_rad, bool forwards);

void hall_open_wire(struct hall *h, int wire, bool open);
void hall_invert_wire(struct hall *h, int wire, bool inverted);
/* Two wires exchanged, and no others; both the same: none. */
void hall_swap_wires(struct hall *h, int wire, int other);

#endif
