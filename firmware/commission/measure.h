/* SPDX-License-Identifier: MIT */
/*
 * Primitives of measurements on a motor: constant voltage or current, ramp, push, spin, sums over a run, axes of a winding, a
 * turning field and damping of a rotor on it. identify, alignment, `learn hall` and the wiring check are sequences of these,
 * and of pulses.h. Slow loop, bridge on.
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

/* What a measurement acts on. `tuning` is the one in effect. */
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

/* A voltage in a fixed frame; the loop's gains are zero (wiring_tuning). */
void measure_hold_voltage(volatile struct current_loop *c, uint32_t angle_q32, int32_t d_steps, int32_t q_steps);

/* ---- push, coast, spin: in the rotor's frame ---- */

/* A current across the magnets; 0: it coasts. */
void measure_push(const struct measure_io *io, int32_t i_q_q15);

/* Regulates the speed by a q current up to this limit. True when the reference has reached the end of its ramp. */
bool measure_spin(const struct measure_io *io, int32_t rpm, int32_t i_max_q15);

/* EMF in q, from the last sample, Q15. */
int32_t measure_emf_q15(const struct measure_io *io);

/* ---- the encoder ---- */

/* Counts from one value of the counter to another, in the shorter direction. */
int32_t measure_counts(uint32_t from, uint32_t to, int32_t turn);

/* The counter at an index since its flag was cleared; false: none. */
bool measure_index(const struct measure_io *io, uint32_t *at);

/* ---- fit: sums of one run, for regressions of voltage on speed and of speed on time ---- */

struct measure_run {
    int32_t count;
    int64_t i, v, x;    /* q current and a voltage, Q15; speed, rpm Q9 */
    int64_t tx, xx, xv; /* t: numbers of the samples, from 0 */
};

/* Adds the last sample, with this voltage: no sum overflows within 4096 samples. */
void measure_run_add(struct measure_run *r, const struct measure_io *io, int32_t v_q15);

/* ---- axes: the second harmonic of the response over the voltage's angle (alignment.h) ---- */

struct measure_axes {
    int64_t re, im, straight; /* responses rotated back by twice the angle; and along the voltage */
};

/* Adds the current response along an angle and across it. */
void measure_axes_add(struct measure_axes *s, uint32_t angle_q32, int32_t along, int32_t across);

/* The angle of the largest response, or half a turn more. Any context. */
uint32_t measure_axes_angle_q32(const struct measure_axes *s);

/* Second harmonic and mean of the response, in the same unit of 29 bits at most. Any context. */
struct measure_shares {
    int32_t re, im, straight;
};
struct measure_shares measure_axes_shares(const struct measure_axes *s);

/* ==== a rotor on a direct current ==== */

/*
 * On a direct current the rotor oscillates like a pendulum: w0^2 = p Kt I / J, damped only by friction. The field adds damping:
 * it moves slightly against the rotor's relative speed, which needs only a rough period, not the inertia. A filter of 1/16 of
 * the period gives the speed. One count must not move the field by more than 30 degrees: with less than 36 counts in an
 * electrical turn there is less damping. Periods below 40 ms are damped only a little, because of the step of a millisecond.
 * For the same reason damping would excite much faster oscillations, as of a rotor on its coupling: it halves each time that
 * such half periods follow one another.
 */

struct pendulum {
    int32_t sense;         /* +1, or -1 if the encoder counts backwards; 0: unknown, no damping */
    int32_t period_ms;     /* from the parameters */
    int32_t filter_ms;     /* delay of the speed signal */
    int32_t damping_q4;    /* gain */
    bool ahead;            /* direction of the last half period */
    int32_t half_ms;       /* since then */
    int32_t quick;         /* consecutive half periods that were much shorter than period_ms */
    uint32_t error_q32;    /* rotor's angle less the field's, plus an unknown constant */
    uint32_t filtered_q32; /* the same, a sixteenth of a period late */
    uint32_t applied_q32;  /* the field's angle, damping included */
    uint32_t quiet_ms;     /* how long it has been at rest on the field */
};

/* Starts at rest on a field at `field_q32`, the encoder at `encoder_q32`; oscillates with about `period_ms`. Slow loop. */
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

/* True if it has been at rest for half of `period_ms` and at least 16 ms. */
static inline bool pendulum_settled(const struct pendulum *p)
{
    return p->quiet_ms >= 16u && (int32_t)p->quiet_ms >= p->period_ms / 2;
}

/* ==== a field that turns ==== */

/*
 * A pass: the field turns in one direction, from rest to rest. Measured at constant speed: the field's mean lead over the
 * encoder, the encoder's travel, and the EMF. Over a third of an electrical turn, or a whole one, the mean is free of cogging:
 * with three phases its periods are sixths of a turn.
 */

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

/* True if the encoder moved evenly: both distances from one third to the next agree within 1/`part`. Slow loop. */
bool field_pass_even(const struct field_pass *p, int32_t part);

/*
 * The encoder's sixteenths of a count over the measured travel of the field: from the mean of the first third to that of the
 * last, insensitive to stick-slip, plus half of that. The mean over many counts resolves parts of one. Slow loop.
 */
int32_t field_pass_counts_q4(const struct field_pass *p);

#endif
