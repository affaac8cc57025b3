/* SPDX-License-Identifier: MIT */
/*
 * The rotor hangs on a direct current like a pendulum: w0^2 = p Kt I / J, damped by nothing but friction. Here the field damps
 * it: it moves slightly against the rotor's relative speed, which needs no inertia, only a rough period. A filter of a
 * sixteenth of the period gives the speed. One count must not move the field by more than 30 degrees: with less than 36 of
 * them in an electrical turn it damps less. A rotor that swings in less than 40 ms is damped only a little: a step takes a
 * millisecond, and would come too late. For the same reason damping drives what swings much quicker than told, as a rotor does
 * on its coupling: it halves each time that such swings follow one another.
 */
#ifndef FIRMWARE_COMMISSION_PENDULUM_H
#define FIRMWARE_COMMISSION_PENDULUM_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"

struct pendulum {
    int32_t sense;         /* +1, or -1 if the encoder counts backwards; 0: unknown, no damping */
    int32_t period_ms;     /* as far as the parameters know it */
    int32_t filter_ms;     /* delay of the speed signal */
    int32_t damping_q4;    /* gain on the filter's lag */
    bool ahead;            /* at the last half swing */
    int32_t half_ms;       /* since then */
    int32_t quick;         /* half swings, much shorter than told, that followed one another */
    uint32_t error_q32;    /* rotor's angle less the field's, plus an unknown constant */
    uint32_t filtered_q32; /* the same, a sixteenth of a period late */
    uint32_t applied_q32;  /* the field's angle, damping included */
    uint32_t quiet_ms;     /* how long it has stood still on the field */
};

/* Starts at rest on a field at `field_q32`, the encoder at `encoder_q32`; swings in about `period_ms`. Slow loop. */
void pendulum_start(struct pendulum *p, int32_t period_ms, uint32_t encoder_q32, uint32_t field_q32);

/*
 * Sets current and field for the next millisecond: the field is at `field_q32` at the next sample and turns by `step_q32`
 * until the next call. `encoder_q32`: electrical angle of the encoder. Slow loop.
 */
void pendulum_step(struct pendulum *p, volatile struct current_loop *c, uint32_t encoder_q32, uint32_t field_q32,
                   int32_t step_q32, int32_t current_q15);

/* Its motion relative to the field in `filter_ms`. */
static inline int32_t pendulum_speed_q32(const struct pendulum *p)
{
    return (int32_t)(p->error_q32 - p->filtered_q32);
}

/* True if it has stood still for half of `period_ms` and at least 16 ms. */
static inline bool pendulum_settled(const struct pendulum *p)
{
    return p->quiet_ms >= 16u && (int32_t)p->quiet_ms >= p->period_ms / 2;
}

#endif
