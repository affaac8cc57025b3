/* SPDX-License-Identifier: MIT */
/*
 * The rotor's angle by three Hall switches, which cut an electrical turn into six sectors. Where one sector meets the next the
 * angle is known; in between the speed carries it on, and it never leaves its sector.
 *
 *   interrupt   state, count of the sectors, when each edge came, angle (stage_hall.h)
 *   slow loop   the speed: from the edges' times, and while none comes from how long it has not (hall_speed.h)
 *
 * Which state is which sector and where the six edges are a table says (settings/hall_table.h): switches that are inverted,
 * swapped or out of place are a matter of the table, not of the arithmetic.
 */
#ifndef FIRMWARE_CONTROL_HALL_H
#define FIRMWARE_CONTROL_HALL_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/encoder.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/hall_table.h"

#define HALL_EDGES_KEPT 8u /* the last one and those of a turn before, in a power of two */

/* The sector of a state; of one that the table does not have nothing is looked at. */
struct hall_sector {
    uint32_t middle_q32;
    int32_t half_q32; /* of its width: below a quarter turn */
    uint32_t place;   /* 0...5, the way the electrical angle grows */
};

/* From one state to another, from a sample to the next. */
struct hall_move {
    int8_t step;     /* sectors: -1, 0, 1 */
    uint8_t next;    /* the state to go on with: the last one that the table has */
    uint8_t invalid; /* 1: the table has no such state */
    uint8_t skipped; /* 1: these two sectors are not neighbours */
};

/* The slow loop's part. */
struct hall_speed {
    uint32_t count;         /* of the sectors, as of the last step */
    uint32_t clock;         /* of the last edge */
    int32_t direction;      /* of the last edges: -1, 1; 0: none is known */
    uint32_t intervals;     /* between edges in this direction, without a turn back: so many can be looked at */
    bool lost;              /* the last edge is too long ago: at rest */
    bool told;              /* somebody has told the speed, */
    uint32_t told_clock;    /* then */
    int32_t speed_q32;      /* turns a sample */
    uint32_t age_clocks;    /* since the last edge */
    uint32_t sector_clocks; /* from the one before to that */
    uint32_t clocks;        /* in which it was measured, or since the last edge if that is longer */
    int32_t load_q8;        /* what the load changes the speed by in a millisecond, as push_q8 */
    /* what torque and that load would have made of it: a speed, and the angle that it sums up to, which wrap */
    uint64_t pushed_q32;
    uint64_t way_q32;
    uint64_t way_at_q32[HALL_EDGES_KEPT]; /* at the edges */
    uint64_t rest_q32;                    /* the speed less that */
    uint32_t angle_q32;                   /* of the rotor at the last step */
    int32_t travel_q32;                   /* and by how much it has turned since the one before, a sample */
};

struct hall {
    /* of the table */
    struct hall_sector sector[HALL_STATES];
    struct hall_move move[HALL_STATES][HALL_STATES];
    uint32_t edge_q32[HALL_SECTORS]; /* where the sector of that place begins */
    uint32_t clock_share_q28;        /* of a clock, in the time from a sample to the next */
    int32_t push_most_q32;           /* and the largest torque, Q32 of a turn a sample */
    int32_t push_q8; /* by how much an LSB of torque changes the speed in a millisecond, Q32 of a turn a sample */
    /* of the interrupt */
    uint32_t state;
    uint32_t count;                  /* of the sectors, wraps */
    uint32_t clock[HALL_EDGES_KEPT]; /* when the edge to that count came; the fabric's clock */
    uint32_t invalid, skipped;       /* samples with such a state, or such a move, ever */
    struct hall_speed speed;
};

/* Takes the table over; the inertia is the tuning's. Slow loop held, or bridge off. */
void hall_take_table(struct hall *h, const struct hall_table *table, const struct tuning *t);

/* Nothing is known but the state now: the angle is the middle of its sector, at rest. Slow loop, LOOP_HALL, bridge off. */
void hall_begin(struct hall *h, volatile struct current_loop *c, const struct encoder_regs *e);

/*
 * Somebody has told the angle and the speed until now, and `c` has them: from here on the switches do. The load is what the
 * torque is. Single sectors, which show each switch that is out of place, do not count against that for 20 ms. Slow loop,
 * LOOP_HALL, interrupts held.
 */
void hall_go_on(struct hall *h, const volatile struct current_loop *c, const struct encoder_regs *e,
                int32_t torque_q15);

/*
 * The speed, to the interrupt as well, which turns the angle by it. The way between two edges by its time is a mean, and late;
 * so that is done for what the load makes of the speed only, and what `torque_q15` makes of it with the inertia that is told is
 * added without delay. Over a whole turn or half a one, in which misplaced switches cancel, where that takes 20 ms at most;
 * else over the last sector. While no edge comes the rotor turns by less than its sector, which bounds the speed; after a
 * quarter of a second it is 0, and the angle goes to the sector's middle. Slow loop, each millisecond; holds the interrupt back
 * for about 50 cycles.
 */
void hall_speed_step(struct hall *h, volatile struct current_loop *c, const struct encoder_regs *e,
                     const struct tuning *t, int32_t torque_q15);

/*
 * How long the speed loop is to take the measurement for: the longer, the smaller its gains. What its torque makes is seen at
 * once, so it is a quarter of the time; and 8 ms at most, or a rotor at rest would not get the torque that breaks it loose, or
 * holds the load that has come.
 */
static inline uint32_t hall_told_clocks(const struct hall_speed *s)
{
    const uint32_t clocks = s->clocks / 4u;
    const uint32_t most = BOARD_FABRIC_HZ / 125u;
    return clocks < most ? clocks : most;
}

/* An edge should have come, and the next ones may still say why not: a wire is broken, or the rotor stopped. Slow loop. */
static inline bool hall_edge_is_overdue(const struct hall_speed *s)
{
    return s->age_clocks > s->sector_clocks + s->sector_clocks / 4u && s->age_clocks / 4u < s->sector_clocks;
}

/* Whether the table has this state. Any context. */
static inline bool hall_state_is_valid(const struct hall *h, uint32_t state)
{
    return h->move[state][state].invalid == 0u;
}

#endif
