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
    uint32_t temperature, sensed; /* codes of the winding's sensor: the result, and what the next conversion shows */
    uint32_t gain[3];             /* signed, of 8 bits: the gain less 1, in 1/2048 */
    uint32_t settle, modulator, modulator_trip;
    uint32_t valid, valid_sampled; /* phases, of the results and of the running conversion */
    unsigned low_sides;            /* a bit for each phase whose low side is on */
    sim_ps low_since[3], low_until[3];
    sim_ps done_at; /* SIM_NEVER while idle */
};

void adc_reset(struct adc *a);
uint32_t adc_read(const struct adc *a, uint32_t offset);
void adc_write(struct adc *a, uint32_t offset, uint32_t value);

/* True if a trigger now starts a conversion. */
bool adc_listens(const struct adc *a);
/* Bit 2k + 1 of the gates is the low side of phase k. */
void adc_see_gates(struct adc *a, unsigned gates, sim_ps at);
void adc_start(struct adc *a, const uint32_t code[4], sim_ps now, sim_ps done_at);
/* The code of a channel that is sampled after the start. */
void adc_sample(struct adc *a, int channel, uint32_t code);
/* The code of the temperature sensor, behind a conversion: it is converted then, and the next one shows it. */
void adc_sense(struct adc *a, uint32_t code);
/* Ends the conversion; true if it was an overrun. */
bool adc_finish(struct adc *a);
bool adc_overran(const struct adc *a);
bool adc_beyond_limit(const struct adc *a);
uint32_t adc_vbus(const struct adc *a); /* the result, Q15 */
bool adc_interrupt(const struct adc *a);

#endif
