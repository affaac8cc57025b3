/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Fabric slot 1: the sampler (docs/fabric.md). */
#ifndef TWIN_ADC_H
#define TWIN_ADC_H

#include <stdbool.h>
#include <stdint.h>

#include "simtime.h"

struct adc {
    uint32_t control, status;
    uint32_t limit[4];   /* I_TRIP SUM_TRIP V_MIN V_MAX, Q15 */
    bool sum_was_off;    /* at the conversion before */
    uint32_t offset[3];  /* of A B C, 16 times the code at zero current */
    uint32_t result[4];  /* IA IB IC VBUS, Q15, the currents less their offsets */
    uint32_t sampled[4]; /* codes being converted */
    uint32_t sequence;
    uint32_t temperature, sensed; /* codes of the winding's sensor: the result, and the one being converted */
    sim_ps done_at;               /* SIM_NEVER while idle */
};

void adc_reset(struct adc *a);
uint32_t adc_read(const struct adc *a, uint32_t offset);
void adc_write(struct adc *a, uint32_t offset, uint32_t value);

/* True if a trigger now starts a conversion. */
bool adc_listens(const struct adc *a);
void adc_start(struct adc *a, const uint32_t code[4], sim_ps done_at);
/* The code of a channel that is sampled after the start. */
void adc_sample(struct adc *a, int channel, uint32_t code);
/* The code of the temperature sensor, at the start as well. */
void adc_sense(struct adc *a, uint32_t code);
/* Ends the conversion; true if it was an overrun. */
bool adc_finish(struct adc *a);
bool adc_overran(const struct adc *a);
bool adc_beyond_limit(const struct adc *a);
bool adc_interrupt(const struct adc *a);

#endif
