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
 * Set-points, each of which selects its mode. The thread checks one against the present state and leaves it here, in a mailbox
 * of one place: a later one replaces one that has not been taken yet. Only of the cyclic modes two may come within a step,
 * where the master's clock is a little faster: the one before stays beside it. The slow loop takes what is there in its next
 * step, if the drive is still in operation.
 */

struct set_point {
    volatile bool waits;
    uint8_t mode;          /* enum axis_mode */
    int32_t value;         /* rpm, mA, an enum homing_method; or counts, of which there are more bits in the drive */
    bool relative;         /* pp: from the last target, or the shaft, not to `value`; in any case so far beyond: */
    int64_t by;            /* counts */
    bool second;           /* of a cyclic mode: the one before waits, too */
    int32_t first;         /* its value, */
    uint32_t at, first_at; /* and the conversions at which they came */
};

/* Takes what waits. Slow loop, in operation. */
void set_point_take(struct axis *a);

/* ==== cyclic set-points ==== */

/*
 * Set-points a period apart, with linear interpolation: the cyclic synchronous modes of CiA 402 (IEC 61800-7-201), for
 * position, speed and torque alike. A set-point is reached a period after its turn, when the next is due; if none comes, it
 * holds.
 *
 * Time is counted in conversions, many of which a step of the slow loop has. So the turn of a set-point may be between two
 * steps. In whole milliseconds, each time the drive's clock and the master's drift past each other, a set-point would be left
 * out or the reference would stand still for one.
 */

/* An eighth of how far a set-point is off is followed; less than 8 conversions, 0.4 ms at 20 kHz, not at all. */
#define CYCLIC_FOLLOWS 8

struct cyclic {
    int64_t now;     /* at the last step, or at the newest set-point's turn */
    int64_t target;  /* the newest set-point */
    int64_t way;     /* to it, from what the reference was at its turn */
    int32_t period;  /* conversions for that way, */
    int32_t left;    /* and those to go */
    int32_t ahead;   /* conversions that `now` has gone beyond the last step */
    uint32_t due;    /* the newest set-point's turn: a number of a conversion */
    int64_t stepped; /* at the last step, */
    int64_t moved;   /* and from the step before to it */
};

/* Begins at a value, which is also the target. Slow loop, or while it is masked. */
static inline void cyclic_begin(struct cyclic *c, int64_t now)
{
    *c = (struct cyclic){.now = now, .target = now, .stepped = now};
}

/* On to so many conversions after the last step. One division of 64 bits. */
static inline void cyclic_go(struct cyclic *c, int32_t conversions)
{
    const int32_t more = conversions - c->ahead;
    c->ahead = conversions;
    if (more > 0 && c->left > 0) {
        c->left = c->left > more ? c->left - more : 0;
        c->now = c->left == 0 ? c->target : c->target - c->way * c->left / c->period;
    }
}

/*
 * The turn of a set-point that came at conversion `at`: a period after that of the one before, corrected slowly by when it
 * came, so that jitter of less than a step does not move the reference. If it is off by more than a step, its turn is when it
 * came.
 */
static inline uint32_t cyclic_due(struct cyclic *c, uint32_t at, int32_t period, int32_t step)
{
    const uint32_t due = c->due + (uint32_t)period;
    const int32_t off = (int32_t)(at - due);
    c->due = off > step || off < -step ? at : due + (uint32_t)(off / CYCLIC_FOLLOWS);
    return c->due;
}

/* A set-point whose turn is so many conversions after the last step. Slow loop. */
static inline void cyclic_aim(struct cyclic *c, int64_t target, int32_t period, int32_t came)
{
    cyclic_go(c, came);
    c->target = target;
    c->way = target - c->now;
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
 * with no more current than home_pct allows; this module decides what was found.
 *
 * Index: the first pulse that starts after the search did; a given direction always sees the same edge. Hard stop: the shaft
 * stands still at the full permitted current. In a search for an index, that is a failure.
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
    uint32_t blocked_ms; /* how long it has not */
    int64_t zero;        /* HOMING_FOUND: the new zero, in the old counts */
};

/* What a step sees. */
struct homing_view {
    const struct turns *turns;
    int32_t turn;     /* counts */
    int64_t farthest; /* counts: limit of the search */
    bool at_limit;    /* the current is at its limit */
    bool index_seen;  /* since the search began */
    uint32_t index;   /* and where: the counter then */
};

/* Starts here. The caller discards earlier index pulses. Slow loop, or while it is masked. */
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

/* ==== a mode ==== */

/*
 * One mode of operation, as modes.c calls it. A new one is a file with such a structure, a value of enum axis_mode, and a line
 * in the table of modes.c.
 */

struct mode {
    bool needs_encoder;
    bool needs_sensor; /* an encoder or Hall switches: its step leads no field, nor tells the observer of the ramp */
    struct outcome (*check)(const struct axis *a, int32_t value); /* of a set-point; slow loop held. Thread */
    void (*enter)(struct axis *a);                                /* from any other, bumpless; may be NULL. Slow loop */
    void (*aim)(struct axis *a, const struct set_point *s);       /* at a set-point, once entered. Slow loop */
    const struct set_point *(*step)(
        struct axis *a); /* a millisecond; the set-point to go on with, or NULL. Slow loop */
};

extern const struct mode mode_speed, mode_torque, mode_position, mode_homing, mode_cyclic_position, mode_cyclic_speed,
    mode_cyclic_torque, mode_learning;

/* For checks: refused with the limit if beyond +-limit. */
static inline struct outcome mode_within(int32_t x, int32_t limit, enum error error)
{
    return x > limit || x < -limit ? (struct outcome){error, limit} : OUTCOME_OK;
}

/* A set-point of a cyclic mode, which may begin between two steps. Slow loop. */
void mode_aim_cyclic(struct axis *a, const struct set_point *s, int64_t target);

/* What the speed loop may ask for beside the feed-forward torque, which is returned (modes.c). Slow loop. */
int32_t mode_room_beside_known(struct axis *a, struct interval *room);

#endif
