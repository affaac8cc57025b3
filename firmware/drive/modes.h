/* SPDX-License-Identifier: MIT */
/*
 * Modes of operation, named as in CiA 402 (IEC 61800-7-201), and what each does in a step. Any mode can follow any other while
 * the motor turns: the speed loop goes on, or starts from the present torque; position control starts from the shaft's
 * position and speed.
 *
 *   pv    profile velocity: a speed, along the ramp            csv   cyclic synchronous velocity
 *   tq    torque, at once                                      cst   cyclic synchronous torque
 *   pp    profile position: control/profile.h                  csp   cyclic synchronous position
 *   hm    homing: commission/homing.h; then pp holds the zero
 */
#ifndef FIRMWARE_DRIVE_MODES_H
#define FIRMWARE_DRIVE_MODES_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/cogging_learn.h"
#include "firmware/commission/homing.h"
#include "firmware/control/cogging.h"
#include "firmware/control/cyclic.h"
#include "firmware/control/position.h"
#include "firmware/control/profile.h"
#include "firmware/drive/set_point.h"
#include "firmware/settings/error.h"

struct axis;

enum axis_mode {
    AXIS_MODE_SPEED, /* pv */
    AXIS_MODE_TORQUE,
    AXIS_MODE_POSITION, /* pp */
    AXIS_MODE_HOMING,
    AXIS_MODE_CYCLIC_POSITION,
    AXIS_MODE_CYCLIC_SPEED,
    AXIS_MODE_CYCLIC_TORQUE,
    AXIS_MODE_LEARNING, /* not in CiA 402: `learn cogging` */
    AXIS_MODES,
};

/* What the modes need besides speed loop and torque control. */
struct motion {
    struct turns turns;
    bool homed; /* the zero is an index or a hard stop */
    struct profile profile;
    struct position_loop position;
    struct cyclic cyclic; /* units, rpm Q16, or torque in Q31 */
    struct homing homing;
    struct cogging_map cogging;
    bool aimed;          /* pp: a target was set since it was entered */
    int32_t cogging_q15; /* last torque for the shaft's position; the trace shows it */
    struct cogging_learn learn;
};

/* True if a mode sets the torque itself, without the speed loop. Any context. */
static inline bool axis_mode_is_torque(uint32_t mode)
{
    return mode == AXIS_MODE_TORQUE || mode == AXIS_MODE_CYCLIC_TORQUE;
}

/* True if a mode follows set-points a period apart. Any context. */
static inline bool axis_mode_is_cyclic(uint32_t mode)
{
    return mode == AXIS_MODE_CYCLIC_POSITION || mode == AXIS_MODE_CYCLIC_SPEED || mode == AXIS_MODE_CYCLIC_TORQUE;
}

/* True if a mode has a position reference. Any context. */
static inline bool axis_mode_is_position(uint32_t mode)
{
    return mode == AXIS_MODE_POSITION || mode == AXIS_MODE_CYCLIC_POSITION;
}

/* Whether an enum axis_mode is built in and has the sensor that it needs. Thread. */
struct outcome modes_available(const struct axis *a, uint32_t mode);

/* Whether a set-point is allowed now. Slow loop held. Thread. */
struct outcome modes_check(const struct axis *a, const struct set_point *s);

/* Enters a set-point's mode, and takes it. Slow loop, in operation. */
void modes_aim(struct axis *a, const struct set_point *s);

/* Enters a mode from any other, bumpless, between two steps. Slow loop. */
void modes_enter(struct axis *a, enum axis_mode mode);

/* Computes the torque limits for the present mode. Slow loop. */
void modes_limit_torque(struct axis *a);

/* One step in operation. Slow loop. */
void modes_step(struct axis *a);

/* Asks for a torque, within the limits. Slow loop. */
void modes_request_torque(struct axis *a, int32_t torque_q15);

/* The speed loop along its ramp: pv and every stop. Slow loop. */
void modes_control_speed(struct axis *a, int32_t slope_q16);

/* Feed-forward torque: cogging at the shaft's position, and friction in the commanded direction. Seldom. */
int32_t modes_known_torque_q15(struct axis *a);

/* Collects what was learned while the shaft turns, and ends the learning in time. Thread, whenever it has time. */
void drive_learn(struct axis *a);

/* Makes `counts` the new position 0; references move with it. Slow loop, or while it is masked. */
void modes_set_zero(struct axis *a, int64_t counts);

#endif
