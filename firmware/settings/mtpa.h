/* SPDX-License-Identifier: MIT */
/*
 * The currents of least amplitude for a torque (maximum torque per ampere) of a machine with constant inductances.
 *
 * Torque is 1.5 p i_q (psi - L i_d), L = L_q - L_d. Among currents of amplitude I it is largest for
 * i_d = (psi - sqrt(psi^2 + 8 L^2 I^2)) / (4 L) (Morimoto, Takeda, Hirasa, Taniguchi: "Expansion of operating limits for
 * permanent magnet motor by current vector control considering inverter capacity", IEEE Trans. Ind. Appl. 26(5), 1990).
 * With L = 0 that is i_d = 0; with L_d > L_q it is positive. The inductances are apparent ones, flux over current: in saturated
 * iron, the incremental ones, which the current loops see, may be a third of them.
 *
 * All of it: thread, 64-bit divisions and roots.
 */
#ifndef FIRMWARE_SETTINGS_MTPA_H
#define FIRMWARE_SETTINGS_MTPA_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"
#include "lib/q15.h"

#define MTPA_ONE_Q20 (1 << 20)

/* Flux linkages of the magnet and, at a current of i_range, of |L|: in nWb / 2^shift, so the larger has 28 bits. */
struct mtpa_machine {
    int64_t magnet;
    int64_t saliency;
    int32_t shift;
    bool reversed; /* L_d > L_q: i_d is positive */
};

/* Inductances as torque and flux see them. */
static inline int32_t mtpa_ld_uh(const struct params *p)
{
    return p->ld_apparent_uh > 0 ? p->ld_apparent_uh : p->ld_uh;
}

static inline int32_t mtpa_lq_uh(const struct params *p)
{
    return p->lq_apparent_uh > 0 ? p->lq_apparent_uh : p->lq_uh;
}

/* Amplitudes, Q20 of i_range; torque in its own unit, up to 2^51. */
struct mtpa_point {
    int64_t i_d_q20;
    int64_t i_q_q20;
    int64_t torque;
};

/* Any parameters within their ranges. */
struct mtpa_machine mtpa_machine(const struct params *p);

/* For an amplitude of 0...2 i_range. */
struct mtpa_point mtpa_point(const struct mtpa_machine *m, int64_t i_q20);

/* Torque per ampere and 1.5 pole pairs at a current of i_range, as a magnet flux, nWb: the value of a torque of 1.0. */
int64_t mtpa_flux_nwb(const struct params *p);

/* Root of a square of 0...2^63 - 1, rounded down. */
int64_t mtpa_root(int64_t square);

/* ==== the table ==== */

/*
 * From torque to currents: the currents above as a table over torque. Torque is per unit, Q15: 1.0 is the most a current of
 * i_range produces. So with L_d = L_q, torque and i_q are the same number.
 *
 * TORQUE_NODES nodes are 2^shift apart; i_max lies in the upper half. Between them currents and flux lie on chords: the current
 * is slightly above the least, never more than i_max, and the assumed flux is never below the actual.
 */
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
