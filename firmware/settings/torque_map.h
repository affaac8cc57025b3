/* SPDX-License-Identifier: MIT */
/*
 * From torque to currents: the currents of mtpa.h as a table over torque. Torque is per unit, Q15: 1.0 is the most a current of
 * i_range produces. So with L_d = L_q, torque and i_q are the same number.
 *
 * TORQUE_NODES nodes are 2^shift apart; i_max lies in the upper half. Between them currents and flux lie on chords: the current
 * is slightly above the least, never more than i_max, and the assumed flux is never below the actual.
 */
#ifndef FIRMWARE_SETTINGS_TORQUE_MAP_H
#define FIRMWARE_SETTINGS_TORQUE_MAP_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/mtpa.h"
#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"
#include "lib/q15.h"

#define TORQUE_NODES 33

struct torque_map {
    int32_t shift;
    int32_t torque_max_q15; /* of i_max */
    int32_t i_d_q15[TORQUE_NODES];
    int32_t i_q_q15[TORQUE_NODES];
    int32_t current_q15[TORQUE_NODES]; /* amplitude */
    int32_t flux_q15[TORQUE_NODES];    /* as voltage at the base speed of tuning.h */
};

/* Progress of the table, and the next node's starting point. */
struct torque_map_builder {
    struct mtpa_machine machine;
    int64_t unit;               /* torque of a current of i_range, over 256 */
    int64_t last_q20, step_q20; /* the last node's current, and the largest step to the next */
    int32_t node;
};

/*
 * Fills the table, which takes up to 4 ms: one node per torque_map_build_step(), which returns whether more remain. `t` must be
 * derived from `p`; neither may change meanwhile. Thread, bridge off.
 */
void torque_map_build_begin(struct torque_map_builder *b, struct torque_map *m, const struct params *p,
                            const struct tuning *t);
bool torque_map_build_step(struct torque_map_builder *b, struct torque_map *m, const struct params *p,
                           const struct tuning *t);

/*
 * The largest torque, Q15, at which a column of the table does not exceed `most`; 0 if it does even at no torque. The columns
 * current and flux rise with torque. Any context, about 60 cycles.
 */
static inline int32_t torque_map_reach(const struct torque_map *m, const int32_t *column, int32_t most)
{
    int32_t n = 0;
    for (int32_t step = (TORQUE_NODES - 1) / 2; step > 0; step /= 2) {
        n += column[n + step] <= most ? step : 0;
    }
    const int32_t gap = q15_max(column[n + 1] - column[n], 1);
    const int32_t part = q15_clamp(most - column[n], 0, gap);
    return (n << m->shift) + (int32_t)(((uint32_t)part << m->shift) / (uint32_t)gap);
}

/* A column at a torque of 0...32767, interpolated and rounded to nearest. Any context. */
static inline int32_t torque_map_at(const struct torque_map *m, const int32_t *column, int32_t torque_q15)
{
    const int32_t n = torque_q15 >> m->shift;
    const int32_t part = torque_q15 - (n << m->shift);
    return column[n] + (((column[n + 1] - column[n]) * part + ((1 << m->shift) >> 1)) >> m->shift);
}

#endif
