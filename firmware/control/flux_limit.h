/* SPDX-License-Identifier: MIT */
/*
 * The flux that the bus voltage allows at the present speed, for field weakening. Once a millisecond, in the slow loop.
 *
 * Feed-forward. The voltages are v = R i + j w psi, so v^2 = (R i)^2 + 2 R P / 1.5 + (w psi)^2 with P the mechanical power: the
 * resistive drop reduces the flux allowed when motoring and raises it when braking. A 32nd of the circle is kept for control.
 *
 * Feedback. While the flux limit decides, the voltage amplitude must equal the circle less the reserve. An eighth of the error
 * a millisecond is integrated into a voltage that is added before division by speed, so its gain on the flux goes with 1 / |w|.
 * The trim is at most half the circle downwards: saturating iron has far more flux at small currents than the apparent
 * inductances say. It is a quarter upwards: at the end of the range the remaining flux is a small difference of two, each known
 * within some percent. It is an eighth upwards while braking: with too much flux a braking current grows by itself. It fades
 * while the limit does not decide.
 *
 * Formats: voltages Q15 of v_range, fluxes voltage at the base speed (torque_map.h).
 */
#ifndef FIRMWARE_CONTROL_FLUX_LIMIT_H
#define FIRMWARE_CONTROL_FLUX_LIMIT_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/config.h"
#include "firmware/settings/tuning.h"
#include "lib/q15.h"

#define FLUX_UNLIMITED     INT32_MAX
#define FLUX_RESERVE_SHIFT 5 /* of the circle */

struct flux_limit {
    int32_t flux_q15;    /* FLUX_UNLIMITED if the voltage allows any flux asked for */
    bool decides;        /* the currents are for a limited flux; set by the caller that asks for them */
    bool exceeded;       /* the motor brakes, and its voltage exceeds the limit */
    int32_t trim_q21;    /* voltage, 6 more bits of fraction */
    int32_t short_d_q15; /* beyond the circle: d's mean shortfall from its reference */
    int32_t drop_q15;    /* the resistance's part of the squared voltage; negative while braking */
};

#define FLUX_TRIM_FADE 16 /* milliseconds */

/* The bridge goes off, or the limit is far. */
static inline void flux_limit_reset(struct flux_limit *s)
{
    *s = (struct flux_limit){.flux_q15 = FLUX_UNLIMITED};
}

/*
 * One step: `power_q15` is the last torque times the present speed, `most_q15` the largest flux ever asked for. Returns whether
 * the limit is near; it nearly never is, and is then followed each millisecond, else every second one.
 */
bool flux_limit_follow(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                       int32_t vbus_q15, int32_t power_q15, int32_t most_q15);

/* Sets the interrupt's limits until the next step (stage_weaken.h): in field weakening, after the references are set. */
void flux_limit_guide(volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15);

/* The flux this bus allows at |w|, ignoring resistance. w_q15 > 0. Any context. */
int32_t flux_limit_at(int32_t vbus_q15, int32_t w_q15);

/* The change of q current the reserved voltage makes in a millisecond. Any context. */
int32_t flux_limit_slew_q15(const struct tuning *t, int32_t vbus_q15);

#endif
