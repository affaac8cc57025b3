/* SPDX-License-Identifier: MIT */
/*
 * A pass: the field turns one way, from rest to rest. The part at constant speed is measured: the field's mean lead over the
 * encoder, the encoder's travel, and the voltage that the magnets induce. Over a third of an electrical turn, or a whole one,
 * the mean is free of cogging: with three phases its periods are sixths of a turn.
 */
#ifndef FIRMWARE_COMMISSION_FIELD_PASS_H
#define FIRMWARE_COMMISSION_FIELD_PASS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/pendulum.h"

#define PASS_THIRDS         3u
#define PASS_MEASURE_MS_MAX 8000u

struct field_pass {
    int32_t step_q32;    /* the field's speed per millisecond, signed */
    uint32_t ramp_ms;    /* from rest to that speed, and back; half of it runs before the measurement */
    uint32_t measure_ms; /* a multiple of PASS_THIRDS, at most PASS_MEASURE_MS_MAX */
    uint32_t time_ms;
    uint32_t field_q32;
    uint32_t reference_q32; /* field less encoder at the first sample measured */
    int32_t sum_q19;        /* of the difference to it, over the samples measured */
    int32_t sum_v_q_q15;
    int32_t sum_counts[PASS_THIRDS]; /* of the encoder, over each third, relative to the start of the first */
    int32_t first_counts;
};

/* Starts from rest at p->field_q32. Slow loop. */
void field_pass_start(struct field_pass *p, int32_t step_q32, uint32_t ramp_ms, uint32_t measure_ms);

/* One millisecond; `counts`: the encoder's, unwrapped. True when the field has come to rest. Slow loop. */
bool field_pass_step(struct field_pass *p, struct pendulum *rotor, volatile struct current_loop *c,
                     uint32_t encoder_q32, int32_t counts, int32_t current_q15);

/* Field less encoder, mean of the samples measured. Slow loop. */
uint32_t field_pass_mean_q32(const struct field_pass *p);

/*
 * True if the encoder moved as evenly as a rotor that follows: both distances from one third to the next agree to one
 * `part`-th. Slow loop.
 */
bool field_pass_even(const struct field_pass *p, int32_t part);

/*
 * The encoder's sixteenths of a count over the measured travel of the field: from the mean of the first third to that of the
 * last, immune to stick and slip, plus half of that. A mean over many counts knows parts of one. Slow loop.
 */
int32_t field_pass_counts_q4(const struct field_pass *p);

#endif
