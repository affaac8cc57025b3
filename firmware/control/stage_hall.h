/* SPDX-License-Identifier: MIT */
/*
 * Runs after the current loop's four stages with Hall switches (hall.h): reads the state and its edge's time, latched with the
 * sample, and predicts the angle at the next sample. ISR, constant time: what does not apply is masked.
 */
#ifndef FIRMWARE_CONTROL_STAGE_HALL_H
#define FIRMWARE_CONTROL_STAGE_HALL_H

#include "firmware/control/hall.h"
#include "lib/q15.h"

/* Shifts to a share of a sample in Q15, and to a speed it may be multiplied by. */
#define HALL_SHARE_SHIFT 13
#define HALL_SPEED_SHIFT 15

/* The angle at the sample, if an edge came since the one before: beyond the edge by speed times its age. */
static inline uint32_t hall_beyond_edge(const struct hall *h, uint32_t edge_q32, uint32_t age_clocks, int32_t speed_q32)
{
    const uint32_t share_q15 = (age_clocks * h->clock_share_q28) >> HALL_SHARE_SHIFT;
    return edge_q32 + (uint32_t)(speed_q32 >> HALL_SPEED_SHIFT) * share_q15;
}

/* If none did: as predicted, but within the sector. */
static inline uint32_t hall_within(const struct hall_sector *s, uint32_t angle_q32)
{
    const int32_t off_q32 = (int32_t)(angle_q32 - s->middle_q32);
    return s->middle_q32 + (uint32_t)q15_clamp(off_q32, -s->half_q32, s->half_q32);
}

/* The speed is the slow loop's. */
static inline __attribute__((always_inline)) void hall_observe(struct current_loop *c, struct hall *h,
                                                               const struct encoder_regs *e)
{
    const uint32_t clock = encoder_hall_clock(e);
    const uint32_t age_clocks = encoder_latch_clock(e) - clock;
    const struct hall_move move = h->move[h->state][encoder_hall_latched(e)];
    const struct hall_sector *const s = &h->sector[move.next];
    const int32_t speed_q32 = c->pll.speed_q32;
    const uint32_t edge_q32 = s->middle_q32 - (uint32_t)(move.step * s->half_q32);
    const uint32_t crossed_q32 = hall_beyond_edge(h, edge_q32, age_clocks, speed_q32);
    const uint32_t within_q32 = hall_within(s, c->pll.angle_q32);
    const uint32_t crossed = 0u - ((uint32_t)move.step & 1u);
    const uint32_t count = h->count + (uint32_t)(int32_t)move.step;
    c->pll.angle_q32 = (within_q32 ^ ((within_q32 ^ crossed_q32) & crossed)) + (uint32_t)speed_q32;
    h->clock[count % HALL_EDGES_STORED] = clock;
    h->count = count;
    h->state = move.next;
    h->invalid += move.invalid;
    h->skipped += move.skipped;
}

#endif
