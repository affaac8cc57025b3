/* SPDX-License-Identifier: MIT */
/*
 * Modes of operation, named as in CiA 402 (IEC 61800-7-201), and what each does in a step. Any mode can follow any other while
 * the motor turns: the speed loop goes on, or starts from the present torque; position control starts from the shaft's
 * position and speed.
 *
 *   pv    profile velocity: a speed, along the ramp            csv   cyclic synchronous velocity
 *   tq    torque, at once                                      cst   cyclic synchronous torque
 *   pp    profile position: control/profile.h                  csp   cyclic synchronous position
 *   hm    homing; then pp holds the zero
 */
#ifndef FIRMWARE_DRIVE_MODES_H
#define FIRMWARE_DRIVE_MODES_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/learn.h"
#include "firmware/control/cogging.h"
#include "firmware/control/position.h"
#include "firmware/control/profile.h"
#include "firmware/settings/error.h"
#include "firmware/settings/tuning.h"

struct axis;

/* ==== set-points ==== */

/*
 * A set-point, which also selects its mode. The thread checks it against the present state and puts it into a mailbox with one
 * place: a later one replaces one that has not been taken yet. In the cyclic modes two may arrive within a step if the master's
 * clock is a little faster; then the earlier one is kept as well. The slow loop takes them in its next step, if operation is
 * still enabled.
 */

struct set_point {
    volatile bool waits;
    uint8_t mode;          /* enum axis_mode */
    int32_t value;         /* rpm, mA, an enum homing_method; or the lower 32 bits of a position in counts */
    bool relative;         /* pp: from the last target, or the actual position, not to `value`; plus */
    int64_t by;            /* counts */
    bool second;           /* of a cyclic mode: the previous one waits, too */
    int32_t first;         /* its value */
    uint32_t at, first_at; /* conversions at which they arrived */
};

/* Takes what is in the mailbox. Slow loop, in operation. */
void set_point_take(struct axis *a);

/* ==== cyclic set-points ==== */

/*
 * Set-points a period apart, with linear interpolation: the cyclic synchronous modes of CiA 402 (IEC 61800-7-201), for
 * position, speed and torque alike. A set-point is reached a period after its due time, when the next one is due; if none
 * comes, the reference holds there.
 *
 * Time is counted in conversions of the current loop, many to a step of the slow loop, so a due time may lie between two steps.
 * Counted in whole milliseconds, a set-point would be skipped or repeated whenever the drive's clock and the master's drift
 * past each other.
 */

/* Due times follow 1/8 of the deviation of arrival; less than 8 conversions, 0.4 ms at 20 kHz, is ignored. */
#define CYCLIC_FOLLOWS 8

struct cyclic {
    int64_t now;      /* at the last step, or at the newest set-point's due time */
    int64_t target;   /* the newest set-point */
    int64_t distance; /* to it from the reference at its due time */
    int32_t period;   /* conversions for that distance */
    int32_t left;     /* and those that remain */
    int32_t ahead;    /* conversions that `now` has gone beyond the last step */
    uint32_t due;     /* the newest set-point's due time: number of a conversion */
    int64_t stepped;  /* at the last step */
    int64_t moved;    /* from the step before */
};

/* Begins at a value, which is also the target. Slow loop, or while it is masked. */
static inline void cyclic_begin(struct cyclic *c, int64_t now)
{
    *c = (struct cyclic){.now = now, .target = now, .stepped = now};
}

/* Advances to so many conversions after the last step. One division of 64 bits. */
static inline void cyclic_go(struct cyclic *c, int32_t conversions)
{
    const int32_t more = conversions - c->ahead;
    c->ahead = conversions;
    if (more > 0 && c->left > 0) {
        c->left = c->left > more ? c->left - more : 0;
        c->now = c->left == 0 ? c->target : c->target - c->distance * c->left / c->period;
    }
}

/*
 * Due time of a set-point that arrived at conversion `at`: a period after the previous one's, corrected slowly by the time of
 * arrival, so that jitter of less than a step does not disturb the reference. If the two differ by more than a step, it is the
 * time of arrival.
 */
static inline uint32_t cyclic_due(struct cyclic *c, uint32_t at, int32_t period, int32_t step)
{
    const uint32_t due = c->due + (uint32_t)period;
    const int32_t off = (int32_t)(at - due);
    c->due = off > step || off < -step ? at : due + (uint32_t)(off / CYCLIC_FOLLOWS);
    return c->due;
}

/* A set-point that is due so many conversions after the last step. Slow loop. */
static inline void cyclic_aim(struct cyclic *c, int64_t target, int32_t period, int32_t came)
{
    cyclic_go(c, came);
    c->target = target;
    c->distance = target - c->now;
    c->period = c->left = period;
}

/* One step, so many conversions after the last. Slow loop. */
static inline int64_t cyclic_step(struct cyclic *c, int32_t conversions)
{
    cyclic_go(c, conversions);
    c->ahead = 0;
    c->moved = c->now - c->stepped;
    c->stepped = c->now;
    return c->now;
}

/* ==== homing ==== */

/*
 * Homing: a search at constant speed for the zero of position, the encoder's index or a hard stop. The caller turns the shaft,
 * with the current limited by home_pct; this decides what was found.
 *
 * Index: the first pulse that starts after the search; in a given direction it is always the same edge. Hard stop: the shaft
 * stands still at the current limit. In a search for an index that is a failure.
 */

enum homing_method {
    HOMING_INDEX,
    HOMING_BLOCK,
    HOMING_METHODS,
};

enum homing_result {
    HOMING_SEARCHES,
    HOMING_FOUND,
    HOMING_FAILED,
};

struct homing {
    uint32_t method;     /* enum homing_method */
    int64_t from;        /* counts where the search began */
    int64_t counted;     /* counts when the shaft last moved by two or more */
    uint32_t blocked_ms; /* how long ago */
    int64_t zero;        /* HOMING_FOUND: the new zero, as a position */
};

/* Inputs of a step. */
struct homing_view {
    const struct turns *turns;
    int32_t turn;     /* counts */
    int64_t farthest; /* counts: limit of the search */
    bool at_limit;    /* the current is at its limit */
    bool index_seen;  /* since the search began */
    uint32_t index;   /* counter at the index */
};

/* Starts at the present position. The caller discards earlier index pulses. Slow loop, or while it is masked. */
void homing_begin(struct homing *h, enum homing_method method, const struct turns *turns);

/* One step a millisecond. Slow loop. */
enum homing_result homing_step(struct homing *h, const struct homing_view *v);

/* ==== the modes ==== */

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
    bool homed; /* the zero was found by homing */
    struct profile profile;
    struct position_loop position;
    struct cyclic cyclic; /* units, rpm Q16, or torque in Q31 */
    struct homing homing;
    struct cogging_map cogging;
    bool aimed;          /* pp: a target was set since it was entered */
    int32_t cogging_q15; /* last compensation torque; in the trace */
    struct cogging_learn learn;
};

/* True if a mode sets the torque itself, without the speed loop. Any context. */
static inline bool axis_mode_is_torque(uint32_t mode)
{
    return mode == AXIS_MODE_TORQUE || mode == AXIS_MODE_CYCLIC_TORQUE;
}

/* True if a mode follows cyclic set-points. Any context. */
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

/* Enters a mode from any other, bumpless, between two steps. Slow loop. */
void modes_enter(struct axis *a, enum axis_mode mode);

/* Computes the torque limits for the present mode. Slow loop. */
void modes_limit_torque(struct axis *a);

/* One step in operation. Slow loop. */
void modes_step(struct axis *a);

/* Sets the torque reference, within the limits. Slow loop. */
void modes_request_torque(struct axis *a, int32_t torque_q15);

/* The speed loop along its ramp: pv and every stop. Slow loop. */
void modes_control_speed(struct axis *a, int32_t slope_q16);

/* Feed-forward torque: cogging at the shaft's position, and friction in the commanded direction. Slow loop. */
int32_t modes_feedforward_torque_q15(struct axis *a);

/* Evaluates samples while the shaft turns, and ends the measurement. Thread, in its idle loop. */
void drive_learn(struct axis *a);

/* Makes `counts` the new position 0; references move with it. Slow loop, or while it is masked. */
void modes_set_zero(struct axis *a, int64_t counts);

/* ==== a mode ==== */

/*
 * One mode of operation, as modes.c calls it. A new mode needs a file with such a structure, a value of enum axis_mode, and a
 * line in the table of modes.c.
 */

struct mode {
    bool needs_encoder;
    bool needs_sensor; /* an encoder or Hall switches: it does not work with I-f control or the observer */
    struct outcome (*check)(const struct axis *a, int32_t value); /* of a set-point; slow loop masked. Thread */
    void (*enter)(struct axis *a);                          /* from any other mode, bumpless; may be NULL. Slow loop */
    void (*aim)(struct axis *a, const struct set_point *s); /* applies a set-point, once entered. Slow loop */
    const struct set_point *(*step)(
        struct axis *a); /* each millisecond; the set-point to change to, or NULL. Slow loop */
};

extern const struct mode mode_speed, mode_torque, mode_position, mode_homing, mode_cyclic_position, mode_cyclic_speed,
    mode_cyclic_torque, mode_learning;

/* For checks: refused, with the limit as detail, if beyond +-limit. */
static inline struct outcome mode_within(int32_t x, int32_t limit, enum error error)
{
    return x > limit || x < -limit ? (struct outcome){error, limit} : OUTCOME_OK;
}

/* Applies a set-point of a cyclic mode, which may be due between two steps. Slow loop. */
void mode_aim_cyclic(struct axis *a, const struct set_point *s, int64_t target);

/* Torque limits that are left for the speed loop after the feed-forward torque, which is returned. Slow loop. */
int32_t mode_torque_room(struct axis *a, struct interval *room);

#endif
