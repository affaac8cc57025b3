/* SPDX-License-Identifier: MIT */
/* Where the rotor is when the encoder has failed, from what can still be trusted. */
#include "firmware/axis/axis.h"
#include "lib/angle.h"

/* The frame is that of the next sample. */
static void by_frame(const struct axis *a, struct rotor_seed *seed)
{
    seed->speed_q32 = a->loop.pll.speed_q32;
    seed->angle_q32 = current_loop_angle_q32(&a->loop) - (uint32_t)seed->speed_q32;
    seed->clock = encoder_latch_clock(&a->fabric->encoder);
}

/* Counts were lost one by one: by the index, else the EMF of the last four milliseconds, in the frame of the last sample. */
static void by_slip(const struct axis *a, struct rotor_seed *seed)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    by_frame(a, seed);
    if (e->index_slip) {
        seed->angle_q32 -= (uint32_t)e->index_drift * a->loop.encoder_scale_q32;
        return;
    }
    seed->angle_q32 += emf_angle_q32(&e->emf.filtered, seed->speed_q32 < 0);
}

/* The index tells how many counts it is off, unless the index itself is wrong and the EMF agrees with the frame. */
static void by_index(const struct axis *a, struct rotor_seed *seed)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    by_frame(a, seed);
    const bool agrees = emf_is_clear(&e->emf) && emf_judge(&e->emf, seed->speed_q32 < 0) == EMF_AGREES;
    if (!agrees || a->tuning.reluctant) { /* which looks nearly the same after half a turn */
        seed->angle_q32 -= (uint32_t)e->index_drift * a->loop.encoder_scale_q32;
    }
}

/*
 * Counts that stand still: the edge is half a count from the middle of the present count, and the speed is from before the
 * milliseconds in which the stopped counts may have affected it.
 */
static void by_last_edge(const struct axis *a, struct rotor_seed *seed)
{
    const struct encoder_regs *const encoder = &a->fabric->encoder;
    const int32_t speed_q32 = a->supervision.encoder.speed_moving_q32;
    const int32_t half_q32 = (int32_t)(a->loop.encoder_scale_q32 / 2u);
    *seed = encoder_watch_seed_of(a, encoder_latched(encoder), speed_q32 < 0 ? -half_q32 : half_q32,
                                  encoder_edge_clock(encoder));
    seed->speed_q32 = speed_q32;
}

void encoder_watch_seed_at_sample(const struct axis *a, enum fault cause, struct rotor_seed *seed)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    const struct encoder_regs *const encoder = &a->fabric->encoder;
    const int32_t surprise_q32 = encoder_watch_surprise_q32(a);
    if (cause == FAULT_ENCODER_DEAD) {
        by_last_edge(a, seed);
    } else if (e->doubt_ms != 0u) {
        *seed = e->sound;
    } else if (angle_size_q32(surprise_q32) > e->jump_limit_q32) {
        *seed = encoder_watch_seed_of(a, encoder_latched(encoder), surprise_q32, encoder_latch_clock(encoder));
        seed->speed_q32 = e->speed_q32;
    } else {
        by_frame(a, seed);
    }
}

void encoder_watch_seed(const struct axis *a, enum fault cause, struct rotor_seed *seed)
{
    if (cause == FAULT_ENCODER_DEAD) {
        by_last_edge(a, seed);
    } else if (a->supervision.encoder.doubt_ms != 0u) {
        *seed = a->supervision.encoder.sound;
    } else if (cause == FAULT_ENCODER_SLIP) {
        by_slip(a, seed);
    } else {
        by_index(a, seed);
    }
}

int32_t encoder_watch_torque_q29(const struct axis *a)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    return e->doubt_ms != 0u ? e->torque_q29 : a->speed.integral_q29;
}

void encoder_watch_forget(struct axis *a)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    a->speed.integral_q29 = encoder_watch_torque_q29(a);
    e->doubt_ms = 0;
    e->still_ms = 0;
    e->against_ms = 0;
}
