/* SPDX-License-Identifier: MIT */
/*
 * The currents for a torque where the voltage does not carry the flux of torque_map.h: field weakening, and beyond it the most
 * torque per voltage (MTPV).
 *
 * Of all currents whose flux linkage is psi, those with least amplitude for their torque begin where that contour crosses the
 * MTPA curve, or at i_q = 0 below the magnets' own flux, and end at i_max, at the most torque that the contour has (MTPV), or
 * where v_d would leave the current loop's range. A table has such contours as rows: the lowest flux that i_max leaves, from
 * there closer at first up to the magnets' own, since the end goes with the root of the distance, and as far apart again
 * up to the largest one. A row has nodes at equal steps of the flux vector's angle; near MTPV neighbouring rows are then
 * alike but for their size (Meyer, Boecker: "Optimum control for interior permanent magnet synchronous motors (IPMSM) in
 * constant torque and full range of flux weakening", PEMC 2006, has the order of limits).
 *
 * Why a table of currents. Between nodes currents are interpolated, so what is asked for is a mean of four nodes.
 * Amplitude and flux of a mean are at most the mean of amplitudes and fluxes: a current from the table is never more than
 * i_max, and its flux never more than the one it was asked for, whatever the step of the table. A coarse table costs
 * torque: 0.5 % at most.
 *
 * Constant inductances, the apparent ones. Fluxes are as in torque_map.h: voltage at the base speed, Q15 of v_range; torque and
 * currents, too.
 */
#ifndef FIRMWARE_CONTROL_WEAKENING_H
#define FIRMWARE_CONTROL_WEAKENING_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/params.h"
#include "firmware/settings/torque_map.h"
#include "firmware/settings/tuning.h"

#define WEAKENING_BELOW      16 /* the row of the magnets' flux */
#define WEAKENING_ROWS       25
#define WEAKENING_NODES_BITS 4
#define WEAKENING_NODES      ((1 << WEAKENING_NODES_BITS) + 1)

struct weakening_node {
    int16_t torque_q15, i_d_q15, i_q_q15;
};

struct weakening {
    int32_t top_q15;                  /* with so much the map's currents can do up to i_max */
    int32_t flux_q15[WEAKENING_ROWS]; /* of the rows, rising; with less than the first none of its currents can do */
    struct weakening_node node[WEAKENING_ROWS][WEAKENING_NODES];
};

/* Between two rows: a mean of both, `part` of the upper one. */
struct weakening_row {
    const struct weakening_node *lower, *upper;
    int32_t part_q12;
};

/* The motor as the table sees it, per unit. */
struct weakening_machine {
    int32_t magnet_q15;
    int64_t x_d_q19, x_q_q19; /* apparent reactances at the base speed */
    int64_t torque_unit_q15;  /* the flux that makes a torque of 1.0 with a current of 1.0 */
    int32_t i_max_q15;
    int32_t share_most_q15; /* of the flux in q, which is v_d's; and the angle at which it has that */
    uint32_t angle_most;
};

/* How far the table is. */
struct weakening_builder {
    struct weakening_machine machine;
    int32_t row;
};

/*
 * Fills the table for currents whose v_d is v_d_max_steps at most: a row at each weakening_go_on(), which returns whether there
 * is another. `m` is the finished torque map. Thread, bridge off.
 */
void weakening_begin(struct weakening_builder *b, struct weakening *w, const struct torque_map *m,
                     const struct params *p, const struct tuning *t, int32_t v_d_max_steps);
bool weakening_go_on(struct weakening_builder *b, struct weakening *w, const struct torque_map *m);

/* The row of a flux. Below the lowest one: the lowest, which has no torque; i_max then cannot weaken enough. Any context. */
struct weakening_row weakening_row(const struct weakening *w, int32_t flux_q15);

/* The largest torque of a row whose current is `i_limit_q15` at most; 0 if the row's least current is more. Any context. */
int32_t weakening_torque(const struct weakening_row *r, int32_t i_limit_q15);

/* The currents of a row for a torque: from 0 to the row's largest; less than the first node's is that node's. Any context. */
struct weakening_node weakening_currents(const struct weakening_row *r, int32_t torque_q15);

#endif
