/* SPDX-License-Identifier: MIT */
/*
 * `learn hall`: which state of the Hall switches belongs to which sector, and where the six edges are. A field on which the
 * rotor hangs turns slowly forth and back, and where it stands at each change is recorded:
 *
 *   forth   the field speeds up over a turn, then turns evenly; that is recorded
 *   back    the same the other way
 *
 * Friction lets the rotor lag, and the switches' hysteresis makes them late, both as much one way as the other: the middle of
 * forth and back has neither. Cogging is left, and what pulls more one way; from 45 degrees between forth and back on a load is
 * refused. Nothing is guessed: six states in a ring, each edge once a turn, or no table.
 */
#ifndef FIRMWARE_COMMISSION_HALL_LEARN_H
#define FIRMWARE_COMMISSION_HALL_LEARN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/hall_table.h"

#define HALL_LEARN_TURNS 4 /* electrical, that are recorded each way */

enum hall_learn_result {
    HALL_LEARN_RUNNING,
    HALL_LEARN_DONE,
    HALL_LEARN_BLOCKED, /* no edge came */
    HALL_LEARN_UNCLEAR, /* other than six states in a ring, or unevenly */
    HALL_LEARN_LOAD,    /* forth and back differ too much; what by is in detail_deg */
};

/* An edge, by the state that begins with it forwards. */
struct hall_edge {
    uint32_t from;      /* the state before it */
    uint32_t first_q32; /* where the field was the first time */
    int32_t sum_q8;     /* and how much further the other times, 2^-8 of Q32 */
    uint32_t count;
};

struct hall_learn {
    uint32_t phase, ms;
    uint32_t state;
    uint32_t edges; /* that have come, each way together */
    bool unclear;
    struct hall_edge forth[HALL_STATES], against[HALL_STATES];
    struct hall_table found;
    int32_t detail_deg;
};

/* Bridge on, LOOP_HALL, the rotor at rest on a field along 0. Slow loop. */
void hall_learn_begin(struct hall_learn *l);

/* A millisecond; with HALL_LEARN_DONE the table is in `found`. Slow loop. */
enum hall_learn_result hall_learn_step(struct hall_learn *l, volatile struct current_loop *c,
                                       const struct encoder_regs *e, const struct tuning *t);

/* How many states have shown. Any context. */
int32_t hall_learn_states(const struct hall_learn *l);

#endif
