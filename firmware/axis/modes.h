/* SPDX-License-Identifier: MIT */
/*
 * Modes of operation, by the names of CiA 402 (IEC 61800-7-201), and what each does in a step. From each to each other while
 * the motor turns: the speed loop goes on, or begins with the torque there is; a position begins where the shaft is, at the
 * speed there is.
 *
 *   pv    profile velocity: a speed, along the ramp            csv   cyclic synchronous velocity
 *   tq    torque, at once                                      cst   cyclic synchronous torque
 *   pp    profile position: control/profile.h                  csp   cyclic synchronous position
 *   hm    homing: commission/homing.h; found, pp holds the zero
 */
#ifndef FIRMWARE_AXIS_MODES_H
#define FIRMWARE_AXIS_MODES_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/cogging_learn.h"
#include "firmware/commission/homing.h"
#include "firmware/control/cogging.h"
#include "firmware/control/cyclic.h"
#include "firmware/control/position.h"
#include "firmware/control/profile.h"
#include "firmware/control/turns.h"

struct axis;

enum axis_mode {
    AXIS_MODE_SPEED, /* pv */
    AXIS_MODE_TORQUE,
    AXIS_MODE_POSITION, /* pp */
    AXIS_MODE_HOMING,
    AXIS_MODE_CYCLIC_POSITION,
    AXIS_MODE_CYCLIC_SPEED,
    AXIS_MODE_CYCLIC_TORQUE,
    AXIS_MODE_LEARNING, /* none of CiA 402: `learn cogging` */
    AXIS_MODES,
};

/* What the modes need besides speed loop and torque. */
struct motion {
    struct turns turns;
    bool homed; /* the zero is an index or a block */
    struct profile profile;
    struct position_loop position;
    struct cyclic cyclic; /* units, rpm Q16, or torque in Q31 */
    struct homing homing;
    struct cogging_map cogging;
    int32_t cogging_q15; /* the torque that the shaft's place asked for last; the trace shows it */
    struct cogging_learn learn;
};

/* Whether a mode sets the torque itself, without the speed loop. Any context. */
static inline bool axis_mode_is_torque(uint32_t mode)
{
    return mode == AXIS_MODE_TORQUE || mode == AXIS_MODE_CYCLIC_TORQUE;
}

/* Whether a mode has a reference of position. Any context. */
static inline bool axis_mode_is_position(uint32_t mode)
{
    return mode == AXIS_MODE_POSITION || mode == AXIS_MODE_CYCLIC_POSITION;
}

/* Enters a mode from any other, without a bump, after a step and before the next. Slow loop, or while it is masked. */
void modes_enter(struct axis *a, enum axis_mode mode);

/* Works out the limits of torque for the present mode. Slow loop. */
void modes_limit_torque(struct axis *a);

/* One step in operation. Slow loop. */
void modes_step(struct axis *a);

/* The same in all modes but pv with an encoder. Slow loop. */
void modes_step_other(struct axis *a);

/* The speed loop along its ramp: pv and every stop. Slow loop. */
void modes_control_speed(struct axis *a, int32_t slope_q16);

/* The torque that need not be found: of the shaft's place, and of friction in the direction it is to turn. Seldom. */
int32_t modes_known_torque_q15(struct axis *a);

/* Takes what was learned while it turns, and ends the learning when its time has come. Thread, whenever it has time. */
void axis_learn(struct axis *a);

/* The shaft is at position 0 where it was at `counts`; references move with it. Slow loop, or while it is masked. */
void modes_set_zero(struct axis *a, int64_t counts);

#endif
