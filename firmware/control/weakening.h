/* SPDX-License-Identifier: MIT */
#ifndef FIRMWARE_CONTROL_WEAKENING_H
#define FIRMWARE_CONTROL_WEAKENING_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/config.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"
#include "lib/q15.h"

/* ==== the tables ==== */

/*
 * The currents for a torque if the voltage does not allow mtpa.h's flux: field weakening, and beyond it the most torque
 * per voltage (MTPV).
 *
 * Among currents with flux linkage psi, those with least amplitude for their torque start where that contour crosses the MTPA
 * curve, or at i_q = 0 below the magnets' own flux, and end at i_max, at the contour's maximum torque (MTPV), or where v_d
 * would leave the current loop's range. The table's rows are such contours: from the lowest flux i_max can reach up to the
 * magnets' own, closer at first because a row's end follows the root of the distance, then evenly spaced up to the largest. A
 * row has nodes at equal steps of the flux vector's angle; near MTPV neighbouring rows then differ only in size (Meyer,
 * Boecker: "Optimum control for interior permanent magnet synchronous motors (IPMSM) in constant torque and full range of flux
 * weakening", PEMC 2006, has the order of limits).
 *
 * Why a table of currents. Currents are interpolated between nodes, so each reference is a mean of four nodes. A mean's
 * amplitude and flux are at most the means of amplitudes and fluxes: currents from the table never exceed i_max, nor the
 * requested flux, whatever the table's step. A coarse table costs torque: 0.5 % at most.
 *
 * Constant inductances, the apparent ones. Fluxes are as in mtpa.h: voltage at the base speed, Q15 of v_range; torque and
 * currents, too.
 */

#define WEAKENING_BELOW      16 /* the row of the magnets' flux */
#define WEAKENING_ROWS       25
#define WEAKENING_NODES_BITS 4
#define WEAKENING_NODES      ((1 << WEAKENING_NODES_BITS) + 1)

struct weakening_node {
    int16_t torque_q15, i_d_q15, i_q_q15;
};

struct weakening {
    int32_t top_q15;                  /* flux at which the map's currents suffice up to i_max */
    int32_t flux_q15[WEAKENING_ROWS]; /* of the rows, rising; below the first no current within i_max suffices */
    struct weakening_node node[WEAKENING_ROWS][WEAKENING_NODES];
};

/* Between two rows: a weighted mean, `part` of the upper one. */
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
    int32_t share_max_q15; /* of the flux in q, which v_d carries; and the angle with that share */
    uint32_t angle_max;
};

/* Progress of the table. */
struct weakening_builder {
    struct weakening_machine machine;
    int32_t row;
};

/*
 * Fills the table for currents whose v_d is v_d_max_steps at most: one row per weakening_build_step(), which returns whether
 * more remain. `m` is the finished torque map. Thread, bridge off.
 */
void weakening_build_begin(struct weakening_builder *b, struct weakening *w, const struct torque_map *m,
                           const struct params *p, const struct tuning *t, int32_t v_d_max_steps);
bool weakening_build_step(struct weakening_builder *b, struct weakening *w, const struct torque_map *m);

/* The currents of least amplitude for a torque of 0 or more, whatever their flux. Any context. */
struct weakening_node weakening_least_current(const struct torque_map *m, int32_t torque_q15);

/* The row of a flux. Below the lowest: the lowest, which has no torque, because i_max cannot weaken enough. Any context. */
struct weakening_row weakening_row(const struct weakening *w, int32_t flux_q15);

/* The largest torque of a row whose current is `i_limit_q15` at most; 0 if the row's least current is more. Any context. */
int32_t weakening_torque(const struct weakening_row *r, int32_t i_limit_q15);

/* The currents of a row for a torque: from 0 to the row's largest; less than the first node's is that node's. Any context. */
struct weakening_node weakening_currents(const struct weakening_row *r, int32_t torque_q15);

/* ==== the flux that the voltage leaves ==== */

/*
 * The flux that the bus voltage allows at the present speed, for field weakening. Once a millisecond, in the slow loop.
 *
 * Feed-forward. The voltages are v = R i + j w psi, so v^2 = (R i)^2 + 2 R P / 1.5 + (w psi)^2 with P the mechanical power: the
 * resistive drop reduces the flux allowed when motoring and raises it when braking. A 32nd of the circle is kept for control.
 *
 * Feedback. While the flux limit is active, the voltage amplitude must equal the circle less the reserve. An eighth of the
 * error a millisecond is integrated into a voltage that is added before division by speed, so its gain on the flux goes with 1
 * / |w|. The trim is at most half the circle downwards: with saturation the flux at small currents is much larger than by the
 * apparent inductances. It is a quarter upwards: at the end of the range the remaining flux is a small difference of two
 * values, each accurate to some percent. It is an eighth upwards while braking: with too much flux a braking current increases
 * by itself. It decays while the limit is inactive.
 *
 * Formats: voltages Q15 of v_range, fluxes voltage at the base speed (mtpa.h).
 */

#define FLUX_UNLIMITED     INT32_MAX
#define FLUX_RESERVE_SHIFT 5 /* of the circle */

struct flux_limit {
    int32_t flux_q15;    /* FLUX_UNLIMITED if the voltage allows any requested flux */
    bool decides;        /* the limit is active: currents are for a limited flux; set by the caller */
    bool exceeded;       /* the motor brakes, and its voltage exceeds the limit */
    int32_t trim_q21;    /* voltage, 6 more bits of fraction */
    int32_t short_d_q15; /* beyond the circle: d's mean shortfall from its reference */
    int32_t drop_q15;    /* the resistance's part of the squared voltage; negative while braking */
};

#define FLUX_TRIM_FADE 16 /* milliseconds */

/* When the bridge is switched off, or the limit is far. */
static inline void flux_limit_reset(struct flux_limit *s)
{
    *s = (struct flux_limit){.flux_q15 = FLUX_UNLIMITED};
}

/*
 * One step: `power_q15` is the last torque times the present speed, `max_q15` the largest flux that may be requested. Returns
 * whether the limit is near: then it is updated each millisecond, else every second one.
 */
bool flux_limit_follow(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                       int32_t vbus_q15, int32_t power_q15, int32_t max_q15);

/* Sets the interrupt's limits until the next step (stage_weaken.h): in field weakening, after the references are set. */
void flux_limit_guide(volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15);

/* The flux this bus allows at |w|, ignoring resistance. w_q15 > 0. Any context. */
int32_t flux_limit_at(int32_t vbus_q15, int32_t w_q15);

/* The change of q current the reserved voltage makes in a millisecond. Any context. */
int32_t flux_limit_slew_q15(const struct tuning *t, int32_t vbus_q15);

#endif
