/* SPDX-License-Identifier: MIT */
/*
 * The rotor's angle from three Hall switches, which divide an electrical turn into six sectors. At sector boundaries the angle
 * is known; in between it is extrapolated from the speed and never leaves its sector.
 *
 *   interrupt   state, sector count, time of each edge, angle (current_loop_step.h)
 *   slow loop   the speed: from the edges' times, or, while none comes, from the time since the last (hall.c)
 *
 * A table maps states to sectors and gives the six edges (settings/hall_table.h): inverted, swapped or misplaced switches
 * change the table, not the arithmetic.
 */
#ifndef FIRMWARE_CONTROL_HALL_H
#define FIRMWARE_CONTROL_HALL_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/encoder.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/hall_table.h"

#define HALL_EDGES_STORED 8u /* the last one and those of a turn before, rounded up to a power of two */

/* The sector of a state; unused for a state the table does not have. */
struct hall_sector {
    uint32_t middle_q32;
    int32_t half_q32; /* of its width: below a quarter turn */
    uint32_t place;   /* 0...5, in the direction of increasing electrical angle */
};

/* A transition between states from one sample to the next. */
struct hall_move {
    int8_t step;     /* sectors: -1, 0, 1 */
    uint8_t next;    /* the state to continue with: the newest one in the table */
    uint8_t invalid; /* 1: the table has no such state */
    uint8_t skipped; /* 1: these two sectors are not neighbours */
};

/* The slow loop's part. */
struct hall_speed {
    uint32_t count;         /* sector count at the last step */
    uint32_t clock;         /* of the last edge */
    int32_t direction;      /* of the last edges: -1, 1; 0: unknown */
    uint32_t intervals;     /* valid intervals between edges in this direction */
    bool lost;              /* time-out since the last edge: at rest */
    bool preset;            /* the speed was given by the caller */
    uint32_t preset_clock;  /* at this time */
    int32_t speed_q32;      /* turns a sample */
    uint32_t age_clocks;    /* since the last edge */
    uint32_t sector_clocks; /* between the last two edges */
    uint32_t clocks;        /* measuring time, or the time since the last edge if longer */
    bool by_turn;           /* measured over a whole turn */
    int32_t load_q8;        /* speed change by the load in a millisecond, as push_q8 */
    /* speed predicted from torque and that load, and its integral; both wrap */
    uint64_t pushed_q32;
    uint64_t pushed_angle_q32;
    uint64_t pushed_angle_at_q32[HALL_EDGES_STORED]; /* at the edges */
    uint64_t rest_q32;                               /* the speed less the predicted one */
    int32_t alone_q32;                               /* at rest: the speed that the torque alone would give */
    int64_t alone_angle_q32;                         /* and its integral */
    uint32_t angle_q32;                              /* of the rotor at the last step */
    int32_t travel_q32;                              /* its travel since the step before, per sample */
};

struct hall {
    /* of the table */
    struct hall_sector sector[HALL_STATES];
    struct hall_move move[HALL_STATES][HALL_STATES];
    uint32_t edge_q32[HALL_SECTORS]; /* where each place's sector begins */
    uint32_t clock_share_q28;        /* one clock as a share of the sampling period */
    int32_t push_most_q32;           /* speed change by the largest torque in a millisecond, Q32 of a turn a sample */
    int32_t push_q8;                 /* speed change by an LSB of torque in a millisecond, Q32 of a turn a sample */
    /* of the interrupt */
    uint32_t state;
    uint32_t count;                    /* sectors, wraps */
    uint32_t clock[HALL_EDGES_STORED]; /* time of the edge to that count; the fabric's clock */
    uint32_t invalid, skipped;         /* samples with such a state or move, ever */
    struct hall_speed speed;
};

/* Takes the table; the inertia is the tuning's. Slow loop masked, or bridge off. */
void hall_take_table(struct hall *h, const struct hall_table *table, const struct tuning *t);

/* Starts from the present state alone: the angle is the middle of its sector, at rest. Slow loop, LOOP_HALL, bridge off. */
void hall_begin(struct hall *h, volatile struct current_loop *c, const struct encoder_regs *e);

/*
 * Takes over from another source, whose angle and speed are in `c`. The load is assumed equal to the torque. For 20 ms, single
 * sectors, which depend on misplaced switches, do not override that speed. Slow loop, LOOP_HALL, interrupts masked.
 */
void hall_resume(struct hall *h, const volatile struct current_loop *c, const struct encoder_regs *e,
                 int32_t torque_q15);

/*
 * Estimates the speed and gives it to the interrupt, which advances the angle by it. Distance over time between edges is a
 * delayed mean; so it is used only for the load's part of the speed, and the part due to `torque_q15` and the configured
 * inertia is added without delay. It is taken over a whole or half turn, where misplaced switches cancel, if that takes 20 ms
 * at most; else over the last sector. Without an edge the rotor turns by less than its sector, which limits the speed; after a
 * quarter of a second it is 0, and the angle is set to the sector's middle. Slow loop, each millisecond; holds the interrupt
 * back for about 50 cycles.
 */
void hall_speed_step(struct hall *h, volatile struct current_loop *c, const struct encoder_regs *e,
                     const struct tuning *t, int32_t torque_q15);

/*
 * The measuring time reported to the speed loop, which reduces its gains with it. The effect of its torque is predicted without
 * delay, so it is a quarter of the time; and 8 ms at most, because a rotor at rest needs torque to break loose or to hold a new
 * load.
 */
static inline uint32_t hall_reported_clocks(const struct hall_speed *s)
{
    const uint32_t clocks = s->clocks / 4u;
    const uint32_t most = BOARD_FABRIC_HZ / 125u;
    return clocks < most ? clocks : most;
}

/* An edge is overdue: a broken wire or a stopped rotor, which the next edges may show. Slow loop. */
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
