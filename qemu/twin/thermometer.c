/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "thermometer.h"

#define CODES_PER_K  16
#define CODE_AT_0_C  800
#define LARGEST_CODE 4095

void thermometer_init(struct thermometer *t, const struct motor_params *p, double winding_c)
{
    *t = (struct thermometer){.fitted = p->temperature_sensor != 0,
                              .offset_k = p->temperature_offset_k,
                              .lag_s = p->temperature_lag_s,
                              .shown_c = winding_c};
}

void thermometer_follow(struct thermometer *t, double winding_c, sim_ps now)
{
    t->shown_c += (winding_c - t->shown_c) * -expm1(-sim_to_s(now - t->at) / t->lag_s);
    t->at = now;
}

/* A sensor that is there never shows the code that says there is none. */
static uint32_t code_of(double c)
{
    return (uint32_t)fmin(fmax(floor(c * CODES_PER_K + CODE_AT_0_C + 0.5), 1), LARGEST_CODE);
}

uint32_t thermometer_code(const struct thermometer *t)
{
    if (t->held) {
        return code_of(t->held_c);
    }
    return t->fitted ? code_of(t->shown_c + t->offset_k) : 0;
}

void thermometer_hold(struct thermometer *t, double shown_c)
{
    t->held = true;
    t->held_c = shown_c;
}

void thermometer_let_go(struct thermometer *t)
{
    t->held = false;
}
