/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The fabric as C models of its four blocks, and the wires between them. */
#ifndef TWIN_FABRIC_MODEL_H
#define TWIN_FABRIC_MODEL_H

#include "adc.h"
#include "fabric.h"
#include "pwm.h"
#include "sto.h"

struct fabric_model {
    struct fabric fabric; /* first: the plant knows no more of it */
    struct pwm pwm;
    struct adc adc;
    struct encoder encoder;
    struct gate gate;
    struct sto sto;
    unsigned gates, led; /* what the PWM wishes, and leads an IN/EN driver to, as shown last */
    sim_ps conversion;   /* from the trigger to its end */
};

/* in_en: its drivers have an input and an enable for each leg. */
void fabric_model_init(struct fabric_model *m, sim_ps conversion, bool in_en);
/* Which axis of how many it is; `leader` is axis 0 of the same fabric, NULL for that itself. */
void fabric_model_join(struct fabric_model *m, unsigned axis, unsigned axes, const struct fabric_model *leader);

#endif
