/* SPDX-License-Identifier: MIT */
#include "firmware/settings/hall_table.h"

#include <stddef.h>

/* Six digits, the first one may be a 0. */
static bool split_states(int32_t states, uint32_t state[HALL_SECTORS])
{
    uint32_t rest = (uint32_t)states;
    for (uint32_t n = HALL_SECTORS; n > 0; n--) {
        state[n - 1] = rest % 10u;
        rest /= 10u;
    }
    return rest == 0u;
}

/* Each occurs once, and one switch changes from each to the next: no two change at the same angle. */
static bool in_a_ring(const uint32_t state[HALL_SECTORS])
{
    uint32_t seen = 0;
    bool twice = false;
    for (uint32_t n = 0; n < HALL_SECTORS; n++) {
        const uint32_t changes = state[n] ^ state[(n + 1u) % HALL_SECTORS];
        if (state[n] >= HALL_STATES || (changes & (changes - 1u)) != 0u) {
            return false;
        }
        twice = twice || (seen >> state[n] & 1u) != 0u;
        seen |= 1u << state[n];
    }
    return !twice;
}

static const int32_t *edges_of(const struct params *p, size_t n)
{
    const int32_t *const edges[HALL_SECTORS] = {&p->hall_edge_1_cdeg, &p->hall_edge_2_cdeg, &p->hall_edge_3_cdeg,
                                                &p->hall_edge_4_cdeg, &p->hall_edge_5_cdeg, &p->hall_edge_6_cdeg};
    return edges[n];
}

static bool in_order(const struct params *p)
{
    int32_t turn_cdeg = 0;
    for (uint32_t n = 0; n < HALL_SECTORS; n++) {
        const int32_t distance_cdeg = *edges_of(p, (n + 1u) % HALL_SECTORS) - *edges_of(p, n);
        const int32_t width_cdeg = distance_cdeg < 0 ? distance_cdeg + HALL_TURN_CDEG : distance_cdeg;
        if (width_cdeg < HALL_SECTOR_MIN_CDEG || width_cdeg > HALL_SECTOR_MAX_CDEG) {
            return false;
        }
        turn_cdeg += width_cdeg;
    }
    return turn_cdeg == HALL_TURN_CDEG;
}

enum error hall_table_of(const struct params *p, struct hall_table *t)
{
    if (!split_states(p->hall_states, t->state) || !in_a_ring(t->state)) {
        return ERROR_HALL_STATES;
    }
    for (uint32_t n = 0; n < HALL_SECTORS; n++) {
        t->edge_q32[n] = (uint32_t)(((uint64_t)(uint32_t)*edges_of(p, n) << 32) / HALL_TURN_CDEG);
    }
    return in_order(p) ? ERROR_NONE : ERROR_HALL_EDGES;
}

void hall_table_to_params(const struct hall_table *t, struct params *p)
{
    int32_t *const edges[HALL_SECTORS] = {&p->hall_edge_1_cdeg, &p->hall_edge_2_cdeg, &p->hall_edge_3_cdeg,
                                          &p->hall_edge_4_cdeg, &p->hall_edge_5_cdeg, &p->hall_edge_6_cdeg};
    int32_t states = 0;
    for (uint32_t n = 0; n < HALL_SECTORS; n++) {
        const int32_t cdeg = (int32_t)(((uint64_t)t->edge_q32[n] * HALL_TURN_CDEG + (1u << 31)) >> 32);
        *edges[n] = cdeg == HALL_TURN_CDEG ? 0 : cdeg;
        states = states * 10 + (int32_t)t->state[n];
    }
    p->hall_states = states;
}
