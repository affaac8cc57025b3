/* SPDX-License-Identifier: MIT */
/*
 * What the measurements on a motor are made of: a voltage or a current that stands, a ramp, a push, a spin, sums over a run,
 * the axes of a winding. identify, alignment, `learn hall` and the wiring's check are scripts of these, and of waves
 * (pulses.h), a field that turns (field_pass.h) and a rotor that hangs on it (pendulum.h). Slow loop, bridge on.
 */
#ifndef FIRMWARE_COMMISSION_MEASURE_H
#define FIRMWARE_COMMISSION_MEASURE_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop.h"
#include "firmware/control/speed_loop.h"
#include "firmware/settings/tuning.h"
#include "lib/q15.h"

/* What a script measures with. `tuning` is the one in effect. */
struct measure_io {
    volatile struct current_loop *loop;
    struct fabric *fabric;
    struct speed_loop *speed;
    const struct tuning *tuning;
};

/* ---- ramp: the part of `whole` that is due after `ms`; a step of `most` at most ---- */

static inline int32_t measure_ramp(int32_t whole, uint32_t ms, int32_t rise_ms)
{
    return whole * q15_min((int32_t)ms, rise_ms) / rise_ms;
}

static inline int32_t measure_towards(int32_t now, int32_t target, int32_t most)
{
    return now + q15_clamp(target - now, -most, most);
}

/* ---- hold ---- */

/* Steps of the loop for a voltage. */
int32_t measure_steps(const volatile struct current_loop *c, int32_t v_q15);

/* A voltage in a frame that stands; the loop's gains are zero (wiring_tuning). */
void measure_hold_voltage(volatile struct current_loop *c, uint32_t angle_q32, int32_t d_steps, int32_t q_steps);

/* ---- push, coast, spin: in the rotor's frame ---- */

/* A current across the magnets; 0: it coasts. */
void measure_push(const struct measure_io *io, int32_t i_q_q15);

/* Regulates the speed by a q current up to this limit. True when the reference, on its ramp, has got there. */
bool measure_spin(const struct measure_io *io, int32_t rpm, int32_t i_most_q15);

/* EMF in q, from the last sample, Q15. */
int32_t measure_emf_q15(const struct measure_io *io);

/* ---- the encoder ---- */

/* Counts from one place of the counter to another, the shorter way round a turn. */
int32_t measure_counts(uint32_t from, uint32_t to, int32_t turn);

/* The counter at the index since its flag was cleared; false: none came. */
bool measure_index(const struct measure_io *io, uint32_t *at);

/* ---- fit: sums of one run, for regressions of voltage on speed and of speed on time ---- */

struct measure_run {
    int32_t count;
    int64_t i, v, x;    /* q current and a voltage, Q15; speed, rpm Q9 */
    int64_t tx, xx, xv; /* t: places of the samples, from 0 */
};

/* Adds the last sample, with this voltage: no sum overflows within 4096 samples. */
void measure_run_add(struct measure_run *r, const struct measure_io *io, int32_t v_q15);

/* ---- axes: what goes round twice in a turn of the voltage (alignment.h) ---- */

struct measure_axes {
    int64_t re, im, straight; /* responses turned back by twice the angle; and along the voltage */
};

/* Adds the current response along an angle and across it. */
void measure_axes_add(struct measure_axes *s, uint32_t angle_q32, int32_t along, int32_t across);

/* The angle of the largest response, or half a turn more. Any context. */
uint32_t measure_axes_easy_q32(const struct measure_axes *s);

/* The part of the response that goes round, and the one that does not, in the same unit of 29 bits at most. Any context. */
struct measure_shares {
    int32_t re, im, straight;
};
struct measure_shares measure_axes_shares(const struct measure_axes *s);

#endif
