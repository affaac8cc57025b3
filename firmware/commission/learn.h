/* SPDX-License-Identifier: MIT */
#ifndef FIRMWARE_COMMISSION_LEARN_H
#define FIRMWARE_COMMISSION_LEARN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/cogging.h"
#include "firmware/control/current_loop.h"
#include "firmware/control/position.h"
#include "firmware/settings/hall_table.h"

/* ==== Hall switches ==== */

/*
 * `learn hall`: finds which Hall state belongs to which sector, and where the six edges are. A field that the rotor follows
 * turns slowly forward and back, and its angle at each change is recorded:
 *
 *   forward  the field accelerates over a turn, then turns at constant speed, which is recorded
 *   back     the same in the other direction
 *
 * Friction makes the rotor lag, and hysteresis delays the switches, equally in both directions: the mean of forward and back is
 * free of both. Cogging and loads of one direction remain; above 45 degrees between forward and back it is refused. The table
 * is accepted only with six states in a ring and each edge once a turn.
 */

#define HALL_LEARN_TURNS 4 /* electrical turns recorded in each direction */

enum hall_learn_result {
    HALL_LEARN_RUNNING,
    HALL_LEARN_DONE,
    HALL_LEARN_BLOCKED, /* no edge came */
    HALL_LEARN_UNCLEAR, /* not six states in a ring, or not repeatable */
    HALL_LEARN_LOAD,    /* forward and back differ too much: detail_deg */
};

/* An edge, indexed by the state that begins at it going forwards. */
struct hall_edge {
    uint32_t from;      /* the state before it */
    uint32_t first_q32; /* the field's angle the first time */
    int32_t sum_q8;     /* sum of the other times' differences to it, 2^-8 of Q32 */
    uint32_t count;
};

struct hall_learn {
    uint32_t phase, ms;
    uint32_t state;
    uint32_t edges; /* so far, in both directions */
    bool unclear;
    struct hall_edge forward[HALL_STATES], against[HALL_STATES];
    struct hall_table found;
    int32_t detail_deg;
};

/* Starts; bridge on, LOOP_HALL, the rotor at rest on a field along 0. Slow loop. */
void hall_learn_begin(struct hall_learn *l);

/* One millisecond; on HALL_LEARN_DONE the table is in `found`. Slow loop. */
enum hall_learn_result hall_learn_step(struct hall_learn *l, volatile struct current_loop *c,
                                       const struct encoder_regs *e, const struct tuning *t);

/* Number of states seen. Any context. */
int32_t hall_learn_states(const struct hall_learn *l);

/* ==== cogging ==== */

/*
 * `learn cogging`: the shaft turns slowly forward and back, a turn each, while the torque at each position is recorded: the
 * motor's torque less the accelerating part, T - J dw/dt, which the speed loop's own response does not affect. Friction has the
 * sign of the direction; what depends on position cancels in the mean of both directions (compare Piccoli, Yim: "Anticogging:
 * torque ripple suppression, modeling, and parameter selection", Int. J. Robotics Research 35(1-3), 2016).
 *
 * The slow loop hands each sample to the thread, which correlates it with the possible orders: multiples of the pole pairs
 * (poles and slots give multiples of 2 p; current errors give p, 2 p, 6 p), once and twice a turn. The largest few form the
 * map (control/cogging.h). An odd magnet gives orders of the number of slots, which are not searched.
 */

#define COGGING_CANDIDATES 160
#define COGGING_ORDER_MAX  640
#define COGGING_SAMPLES    64 /* maximum delay of the thread, milliseconds */

enum cogging_phase {
    COGGING_IDLE,
    COGGING_FORWARD_BEGINS,
    COGGING_FORWARD,
    COGGING_BACK_BEGINS,
    COGGING_BACK,
    COGGING_REVIEW, /* the thread evaluates */
    COGGING_DONE,
};

struct cogging_sample {
    uint32_t angle_q32;
    int32_t torque_q19;
    int32_t travel_q7; /* its weight: travel, rpm times milliseconds, so that all positions have equal weight */
};

struct cogging_learn {
    volatile uint32_t phase;      /* enum cogging_phase */
    int64_t from;                 /* counts where the phase began */
    int32_t speed_rpm_q15;        /* at the last step */
    int32_t torque_q15;           /* commanded in the last step but one */
    uint32_t angle_q32;           /* at the last step */
    int32_t travel_q7;            /* in the last step, in the commanded direction */
    volatile uint32_t put, taken; /* samples so far */
    struct cogging_sample samples[COGGING_SAMPLES];
    /* the thread's */
    uint32_t used;
    uint32_t lost;
    int32_t candidates;
    uint16_t orders[COGGING_CANDIDATES];
    int64_t travel_sum_q7;
    int64_t cos_sum[COGGING_CANDIDATES]; /* Q41, below 2^60 */
    int64_t sin_sum[COGGING_CANDIDATES];
};

/* Starts over. Thread, slow loop masked. */
void cogging_learn_begin(struct cogging_learn *l, const struct turns *turns, const struct tuning *t);

/* Direction in which the shaft must turn now: 1 forward, -1 back, 0 not at all. Any context. */
int32_t cogging_learn_direction(const struct cogging_learn *l);

/*
 * One step a millisecond: `torque_q15` is the last step's command. Slow loop, before the next command.
 */
void cogging_learn_step(struct cogging_learn *l, const struct turns *turns, const struct speed_estimate *e,
                        int32_t torque_q15, const struct tuning *t);

/* Takes the slow loop's samples; true once, when all are taken and `m` has the map. Thread. */
bool cogging_learn_review(struct cogging_learn *l, struct cogging_map *m);

#endif
