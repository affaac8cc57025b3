/* SPDX-License-Identifier: MIT */
/*
 * The rotor hangs on a direct current like a pendulum: w0^2 = p Kt I / J, and nothing but its friction damps it. What damps it
 * here is the field: it moves a little against the rotor's speed relative to it, which needs no inertia, only roughly the
 * period. A filter of a sixteenth of the period stands for the speed, so that the steps of a coarse encoder stay small. A rotor
 * that swings in less than 40 ms is damped a little only: a step takes a millisecond, and would come too late.
 */
#ifndef FIRMWARE_COMMISSION_PENDULUM_H
#define FIRMWARE_COMMISSION_PENDULUM_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"

struct pendulum {
    int32_t sense;         /* +1, or -1 where the encoder counts backwards; 0: not known, nothing is damped */
    int32_t period_ms;     /* as far as the parameters know it */
    int32_t filter_ms;     /* what stands for the speed is late by so much */
    int32_t damping;       /* times what the filter is behind */
    uint32_t error_q32;    /* rotor's angle less the field's, by an unknown constant off */
    uint32_t filtered_q32; /* the same, a sixteenth of a period late */
    uint32_t applied_q32;  /* the field's angle, damping included */
    uint32_t quiet_ms;     /* how long it has stood still on the field */
};

/* At rest on a field at `field_q32`, the encoder at `encoder_q32`; swings in `period_ms` or so. Slow loop. */
void pendulum_start(struct pendulum *p, int32_t period_ms, uint32_t encoder_q32, uint32_t field_q32);

/*
 * Sets current and field for the next millisecond: the field stands at `field_q32` at the next sample and turns by `step_q32`
 * until the next call. `encoder_q32`: electrical angle of the encoder. Slow loop.
 */
void pendulum_step(struct pendulum *p, volatile struct current_loop *c, uint32_t encoder_q32, uint32_t field_q32,
                   int32_t step_q32, int32_t current_q15);

/* By how much it turns relative to the field in `filter_ms`. */
static inline int32_t pendulum_speed_q32(const struct pendulum *p)
{
    return (int32_t)(p->error_q32 - p->filtered_q32);
}

/* It has stood still for half of the time `period_ms` and at least 16 ms. */
static inline bool pendulum_settled(const struct pendulum *p)
{
    return p->quiet_ms >= 16u && (int32_t)p->quiet_ms >= p->period_ms / 2;
}

#endif
