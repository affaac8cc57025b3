/* SPDX-License-Identifier: MIT */
/* A step of the supervision (supervision.h), inlined into its caller. Slow loop, last. */
#ifndef FIRMWARE_AXIS_SUPERVISION_STEP_H
#define FIRMWARE_AXIS_SUPERVISION_STEP_H

#include "firmware/axis/axis.h"
#include "firmware/axis/rotor.h"
#include "firmware/axis/supervision.h"
#include "firmware/axis/supervision_phase_step.h"
#include "firmware/axis/supervision_speed_step.h"
#include "lib/angle.h"
#include "lib/q15.h"
#include "lib/usually.h"

static inline void supervise_overspeed(struct axis *a, int32_t w_q15)
{
    if (SELDOM(q15_abs(w_q15) > a->tuning.overspeed_w_q15)) {
        axis_report(a, FAULT_OVERSPEED, a->speed.speed_rpm_q4 / 16, 0);
    }
}

/* The encoder's check every millisecond. Returns how far the count is from where it should be. */
static inline int32_t supervision_look_at_encoder(struct axis *a)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    const struct speed_estimate *const seen = &a->speed.estimate;
    const int32_t speed_q32 = e->speed_q32;
    if (USUALLY(seen->moved != 0)) {
        e->still_ms = 0;
        e->speed_moving_q32 = e->speed_before_q32;
    } else {
        e->still_ms++;
    }
    e->speed_before_q32 = speed_q32;
    e->speed_q32 = a->loop.pll.speed_q32;
    return supervise_encoder_surprise_q32(&a->tuning, seen->moved, seen->step_clocks, speed_q32);
}

/* True if that deviates from the normal case. */
static inline bool supervision_strange(const struct encoder_watch *e, int32_t surprise_q32)
{
    return e->doubt_ms != 0u || angle_size_q32(surprise_q32) > e->jump_limit_q32;
}

/* Together with the torque limits (axis.c). The currents follow the present references until the phases are checked. */
static inline void supervision_step_even(struct axis *a, uint32_t state)
{
    a->supervision.phases.i_d_ref_q15 = a->loop.i_d_ref_q15;
    a->supervision.phases.i_q_ref_q15 = a->loop.i_q_ref_q15;
    supervise_speed_here(a, state);
}

/* The modulator is at its limit, and the current is off by a tenth of i_max. */
static inline bool supervision_voltage_is_short(const struct axis *a)
{
    const struct current_loop *const c = &a->loop;
    const int32_t radius_q15 = c->radius_q15 - (c->radius_q15 >> 5);
    if (USUALLY(c->v_d_q15 * c->v_d_q15 + c->v_q_q15 * c->v_q_q15 <= radius_q15 * radius_q15)) {
        return false;
    }
    const int32_t missing_q15 = q15_abs(c->i_q_ref_q15 - c->i_q_q15) + q15_abs(c->i_d_ref_q15 - c->i_d_q15);
    return missing_q15 > a->tuning.i_max_q15 / 10;
}

static inline void supervision_watch_voltage(struct axis *a)
{
    struct speed_watch *const s = &a->supervision.speed;
    if (SELDOM(supervision_voltage_is_short(a))) {
        supervise_short_voltage(a);
    } else if (SELDOM(s->limited_ms != 0u)) {
        s->limited_ms -= SUPERVISION_TURNS;
    }
}

/* The slow checks: every SUPERVISION_TURNS. */
static inline void supervision_step_slow(struct axis *a)
{
    supervision_watch_voltage(a);
    if (SELDOM(thermal_winding_too_hot(&a->thermal) || thermal_inverter_too_hot(&a->thermal))) {
        supervise_temperature(a);
    }
    if (SELDOM(a->params.command_timeout_ms != 0)) {
        supervise_commands(a);
    }
}

static inline void supervision_step_odd(struct axis *a, uint32_t turn)
{
    supervise_phases_here(a);
    if (turn == 3u) {
        supervision_step_slow(a);
    }
}

/* Checks the encoder's angle by the EMF, if there is enough; and the index, if there was a pulse. */
static inline void supervision_judge_encoder(struct axis *a)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    if (emf_is_clear(&e->emf)) {
        supervise_encoder_by_emf(a);
    } else if (SELDOM(e->against_ms != 0u)) {
        e->against_ms--;
    }
    if (SELDOM(encoder_index(&a->fabric->encoder) != e->index)) {
        supervise_index(a);
    }
}

/* In its turns, while nothing is strange. */
static inline void supervision_compare_with_emf(struct axis *a, int32_t w_q15, uint32_t turn)
{
    if (turn == SUPERVISION_EMF_TURN) {
        emf_step(&a->supervision.encoder.emf, &a->loop, &a->tuning, w_q15, w_q15);
    } else {
        supervision_judge_encoder(a);
    }
}

/* False while it is in doubt: its speed is then in doubt, too. */
static inline bool supervision_encoder_is_sound(struct axis *a, int32_t w_q15, uint32_t turn)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    const int32_t surprise_q32 = supervision_look_at_encoder(a);
    const bool odd = turn % 2u != 0u;
    if (SELDOM(supervision_strange(e, surprise_q32)) || (odd && SELDOM(e->still_ms >= SUPERVISION_STILL_MS))) {
        supervise_encoder(a, surprise_q32, turn);
        return e->doubt_ms == 0u && a->carry.waits == FAULT_NONE; /* the measured speed is the encoder's */
    }
    if (odd) {
        supervision_compare_with_emf(a, w_q15, turn);
    }
    return true;
}

/*
 * The parts take turns to spread the load evenly over the milliseconds: phases and speed every second one, slow checks every
 * fourth.
 */
static inline __attribute__((always_inline)) void supervision_step_running(struct axis *a, uint32_t state, bool encoder,
                                                                           int32_t w_q15)
{
    const uint32_t turn = a->time_ms % SUPERVISION_TURNS;
    if (!encoder) {
        sensorless_supervise(a);
        if (SELDOM(a->carry.waits != FAULT_NONE)) {
            return; /* the bridge may be off */
        }
    } else if (SELDOM(!supervision_encoder_is_sound(a, w_q15, turn))) {
        return;
    }
    supervise_overspeed(a, w_q15);
    if (turn % 2u != 0u) {
        supervision_step_odd(a, turn);
    } else {
        supervision_step_even(a, state);
    }
}

/* `state`: the present one; `encoder`: rotor_has_encoder(), if the caller knows it; `w_q15`: current_loop_w_q15() now. */
static inline __attribute__((always_inline)) void supervision_step_here(struct axis *a, uint32_t state, bool encoder,
                                                                        int32_t w_q15)
{
    if (USUALLY(state == AXIS_OPERATION_ENABLED) || state == AXIS_QUICK_STOP) {
        supervision_step_running(a, state, encoder, w_q15);
    } else if (state == AXIS_SWITCHED_ON) {
        supervise_overspeed(a, current_loop_w_q15(&a->loop));
    }
}

#endif
