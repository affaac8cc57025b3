/* SPDX-License-Identifier: MIT */
/*
 * The flux that the bus voltage carries at the present speed: what field weakening goes by. Once a millisecond, in the
 * slow loop.
 *
 * Feed-forward. The voltages are v = R i + j w psi, so v^2 = (R i)^2 + 2 R P / 1.5 + (w psi)^2 with P the mechanical
 * power: motoring, the resistance takes from what the flux may have, braking it gives. Of the circle a 32nd is kept for
 * control.
 *
 * Feedback. Where the flux limit decides, the length of the voltages must be that of the circle less what is kept. What is
 * missing is integrated, with an eighth a millisecond, into a voltage that is added before the speed divides it: so its
 * gain on the flux goes with 1 / |w|, as does what the flux changes the voltage by. Half of the circle less at most: iron
 * that saturates has far more flux at small currents than the apparent inductances say. A quarter more: where the reach
 * ends, the flux that is left is a small difference of two that are known within some percent each. An eighth more while
 * it brakes: with too much flux a braking current grows by itself. It fades where the limit does not decide.
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

#define FLUX_UNLIMITED  INT32_MAX
#define FLUX_KEPT_SHIFT 5 /* of the circle */

struct flux_limit {
    int32_t flux_q15;    /* FLUX_UNLIMITED where the voltage carries any flux that is asked for */
    bool decides;        /* the currents are those of a limited flux: by who asks for them */
    bool exceeded;       /* the motor brakes, and its voltages are longer than they may be */
    int32_t trim_q21;    /* voltage, 6 more bits of fraction */
    int32_t short_d_q15; /* beyond the circle: what d is short of its reference, mean */
    int32_t drop_q15;    /* what the resistance takes of the square of the voltage; negative while it brakes */
};

#define FLUX_TRIM_FADE 16 /* milliseconds */

/* Seven eighths of the circle less what is kept, by the bus; rounded down. */
#define FLUX_PLENTY_Q15 \
    ((int32_t)(CONFIG_RADIUS_STEPS * 32768LL * 7 * ((1 << FLUX_KEPT_SHIFT) - 1) / (8LL << FLUX_KEPT_SHIFT) / \
               CONFIG_BUS_STEPS))

/*
 * Whether the limit is far, as nearly always: neither the largest flux that is ever asked for takes more than seven eighths of
 * the voltage at this speed, nor do the voltages as they are. vbus_q15 is of now: the current loop's voltages and references
 * are of the step before.
 */
static inline bool flux_limit_is_far(const struct flux_limit *s, const volatile struct current_loop *c, int32_t w_q15,
                                     int32_t vbus_q15, int32_t most_q15)
{
    const int32_t much_q15 = (vbus_q15 * FLUX_PLENTY_Q15) >> 15;
    const int32_t d_q15 = q15_abs(c->v_d_q15);
    const int32_t q_q15 = q15_abs(c->v_q_q15);
    return q15_abs(s->trim_q21) < FLUX_TRIM_FADE && most_q15 <= 2 * Q15_ONE &&
           (uint32_t)q15_abs(w_q15) * (uint32_t)most_q15 <= (uint32_t)much_q15 << 15 &&
           q15_max(d_q15, q_q15) + q15_min(d_q15, q_q15) / 2 <= much_q15; /* an eighth too long at most */
}

/* The bridge goes off, or the limit is far. */
static inline void flux_limit_rest(struct flux_limit *s)
{
    *s = (struct flux_limit){.flux_q15 = FLUX_UNLIMITED};
}

/* Where it is not far, a step: `power_q15` is what the last torque makes of the present speed. Each millisecond. */
void flux_limit_follow(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                       int32_t vbus_q15, int32_t power_q15, int32_t most_q15);

/* What the interrupt may do until the next step (stage_weaken.h): where it weakens, after the references are set. */
void flux_limit_guide(volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15);

/* The flux that this bus carries at |w|, but for the resistance. w_q15 > 0. Any context. */
int32_t flux_limit_at(int32_t vbus_q15, int32_t w_q15);

/* By how much the voltage that is kept changes a current in a millisecond, in q. Any context. */
int32_t flux_limit_slew_q15(const struct tuning *t, int32_t vbus_q15);

#endif
