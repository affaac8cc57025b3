/* SPDX-License-Identifier: MIT */
/*
 * `learn hall`: finds which Hall state belongs to which sector, and where the six edges are. A field that the rotor follows
 * turns slowly forward and back, and its angle at each change is recorded:
 *
 *   forth   the field speeds up over a turn, then turns evenly; that part is recorded
 *   back    the same the other way
 *
 * Friction makes the rotor lag, and hysteresis makes the switches late, equally in both directions: the middle of forth and
 * back is free of both. Cogging and one-sided loads remain; from 45 degrees between forward and back on, a load is refused.
 * Nothing is guessed: six states in a ring, each edge once a turn, or no table.
 */
#ifndef FIRMWARE_COMMISSION_HALL_LEARN_H
#define FIRMWARE_COMMISSION_HALL_LEARN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/hall_table.h"

#define HALL_LEARN_TURNS 4 /* electrical turns recorded each way */

enum hall_learn_result {
    HALL_LEARN_RUNNING,
    HALL_LEARN_DONE,
    HALL_LEARN_BLOCKED, /* no edge came */
    HALL_LEARN_UNCLEAR, /* not six states in a ring, or uneven */
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
    uint32_t edges; /* so far, both ways together */
    bool unclear;
    struct hall_edge forth[HALL_STATES], against[HALL_STATES];
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

#endif
