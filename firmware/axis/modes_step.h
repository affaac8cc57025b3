/* SPDX-License-Identifier: MIT */
/* A step of the modes (modes.h), inlined into its caller for the mode a drive runs in most: speed control. Slow loop. */
#ifndef FIRMWARE_AXIS_MODES_STEP_H
#define FIRMWARE_AXIS_MODES_STEP_H

#include "firmware/axis/axis.h"
#include "firmware/axis/rotor.h"
#include "lib/usually.h"

/* Homing has less, so that the hard stop holds and the machine does not give. */
static inline int32_t modes_i_limit_q15(const struct axis *a, uint32_t mode)
{
    const int32_t most_q15 = thermal_i_limit_q15(&a->thermal, a->tuning.i_max_q15);
    return SELDOM(mode == AXIS_MODE_HOMING) ? q15_min(most_q15, a->tuning.home_i_q15) : most_q15;
}

static inline __attribute__((always_inline)) void modes_limit_torque_here(struct axis *a)
{
    const uint32_t mode = a->mode;
    const struct torque_view view = {
        .speed_rpm_q4 = a->speed.speed_rpm_q4,
        .i_limit_q15 = modes_i_limit_q15(a, mode),
        .limit_speed = axis_mode_is_torque(mode),
    };
    torque_set_limits(&a->torque, &a->tuning, &view);
}

static inline __attribute__((always_inline)) void modes_ask(struct axis *a, int32_t wish_q15)
{
    torque_ask(&a->torque, &a->loop, &a->tuning, wish_q15);
}

/*
 * Computes what the speed loop may ask for on top of the feed-forward torque for cogging and friction. torque_ask() limits the
 * total. Returns the feed-forward torque.
 */
static inline int32_t modes_room_beside_known(struct axis *a, struct interval *room)
{
    *room = a->torque.limits;
    a->speed.torque_is_slow = a->torque.flux.decides;
    if (USUALLY((a->motion.cogging.count | a->tuning.friction_q15) == 0) || !rotor_has_encoder(a)) {
        return 0;
    }
    const int32_t known_q15 = modes_known_torque_q15(a);
    room->low -= known_q15;
    room->high -= known_q15;
    return known_q15;
}

static inline __attribute__((always_inline)) void modes_control_speed_here(struct axis *a, int32_t slope_q16,
                                                                           bool encoder)
{
    if (!encoder && sensorless_lead_field(a, slope_q16)) {
        return;
    }
    struct interval room;
    const int32_t known_q15 = modes_room_beside_known(a, &room);
    modes_ask(a, known_q15 + speed_loop_step(&a->speed, &a->tuning, slope_q16, &room));
    if (!encoder) {
        sensorless_after_control(a);
    }
}

static inline __attribute__((always_inline)) void modes_step_here(struct axis *a)
{
    if (USUALLY(a->mode == AXIS_MODE_SPEED) && USUALLY(rotor_has_encoder(a))) {
        modes_control_speed_here(a, a->tuning.ramp_q16, true);
    } else {
        modes_step_other(a);
    }
}

#endif
