/* SPDX-License-Identifier: MIT */
/*
 * A pass: the field turns one way, from rest to rest, and a part of it at constant speed is measured: by how much the field
 * leads the encoder, on the mean; how far the encoder came; the voltage that the turning magnets induce. Over a third of an
 * electrical turn, or a whole one, the mean is free of cogging: with three phases its periods are sixths of a turn.
 */
#ifndef FIRMWARE_COMMISSION_FIELD_PASS_H
#define FIRMWARE_COMMISSION_FIELD_PASS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/pendulum.h"

#define PASS_THIRDS         3u
#define PASS_MEASURE_MS_MAX 8000u

struct field_pass {
    int32_t step_q32;    /* field's speed, per millisecond, and its sign */
    uint32_t ramp_ms;    /* from rest to that speed, and back; half of it runs before the measurement */
    uint32_t measure_ms; /* a multiple of PASS_THIRDS, at most PASS_MEASURE_MS_MAX */
    uint32_t time_ms;
    uint32_t field_q32;
    uint32_t reference_q32; /* field less encoder at the first sample measured */
    int32_t sum_q19;        /* of what came on top, over the samples measured */
    int32_t sum_v_q_q15;
    int32_t sum_counts[PASS_THIRDS]; /* of the encoder, over each third, from where the first began */
    int32_t first_counts;
};

/* From rest at p->field_q32 on. Slow loop. */
void field_pass_start(struct field_pass *p, int32_t step_q32, uint32_t ramp_ms, uint32_t measure_ms);

/* One millisecond; `counts` of the encoder, unwrapped. True when the field has come to rest. Slow loop. */
bool field_pass_step(struct field_pass *p, struct pendulum *rotor, volatile struct current_loop *c,
                     uint32_t encoder_q32, int32_t counts, int32_t current_q15);

/* Field less encoder, mean of the samples measured. Slow loop. */
uint32_t field_pass_mean_q32(const struct field_pass *p);

/*
 * Whether the encoder went as evenly as a rotor does that follows: both ways from a third to the next agree to
 * one `part`-th. Slow loop.
 */
bool field_pass_even(const struct field_pass *p, int32_t part);

/*
 * Counts of the encoder for the way of the field that was measured: from the mean of the first third to that of the last, which
 * a rotor that sticks and slips does not shift, and half of that on top. Slow loop.
 */
int32_t field_pass_counts(const struct field_pass *p);

#endif
