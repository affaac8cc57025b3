/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A temperature sensor in the winding, as the converter shows it: it follows the copper with a lag of the first order and
 * is off by a constant. 16 codes a kelvin, 800 at 0 degC; 0 means that there is none. */
#ifndef TWIN_THERMOMETER_H
#define TWIN_THERMOMETER_H

#include <stdbool.h>
#include <stdint.h>

#include "motor_params.h"
#include "simtime.h"

struct thermometer {
    bool fitted, held;
    double offset_k, lag_s;
    double shown_c; /* without the offset */
    double held_c;  /* what it shows instead while held */
    sim_ps at;
};

/* It has had the time to take the winding's temperature. */
void thermometer_init(struct thermometer *t, const struct motor_params *p, double winding_c);
/* The winding has had this temperature up to now. */
void thermometer_follow(struct thermometer *t, double winding_c, sim_ps now);
uint32_t thermometer_code(const struct thermometer *t);
/* Shows this temperature whatever the winding has, even if there is no sensor; until let go. */
void thermometer_hold(struct thermometer *t, double shown_c);
void thermometer_let_go(struct thermometer *t);

#endif
