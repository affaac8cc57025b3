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
 * gain on the flux goes with 1 / |w|, as does what the flux changes the voltage by. An eighth of the circle more, half of
 * it less at most: iron that saturates has far more flux at small currents than the apparent inductances say. It fades
 * where the limit does not decide.
 *
 * Formats: voltages Q15 of v_range, fluxes voltage at the base speed (torque_map.h).
 */
#ifndef FIRMWARE_CONTROL_FLUX_LIMIT_H
#define FIRMWARE_CONTROL_FLUX_LIMIT_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"

#define FLUX_UNLIMITED  INT32_MAX
#define FLUX_KEPT_SHIFT 5 /* of the circle */

/*
 * Of v_d where the field is weakened and the motor drives: a 128th of the circle is left, an eighth of it for v_q, for
 * what v_q must change.
 */
#define FLUX_V_D_MAX_STEPS (CONFIG_RADIUS_STEPS - (CONFIG_RADIUS_STEPS >> 7))

struct flux_limit {
    int32_t flux_q15; /* FLUX_UNLIMITED where the voltage carries any flux that is asked for */
    bool decides;     /* the currents are those of a limited flux: by who asks for them */
    int32_t trim_q21; /* voltage, 6 more bits of fraction */
    int32_t drop_q15; /* what the resistance takes of the square of the voltage; negative while it brakes */
};

/*
 * One step: `power_q15` is what the last torque makes of the present speed, `most_q15` the largest flux that is ever asked for.
 * `vbus_q15` is of now: the current loop's voltages and references are of the step before.
 */
void flux_limit_step(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                     int32_t vbus_q15, int32_t power_q15, int32_t most_q15);

/* What the interrupt may do until the next step (stage_weaken.h): where it weakens, after the references are set. */
void flux_limit_guide(volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15);

/* The flux that this bus carries at |w|, but for the resistance. w_q15 > 0. Any context. */
int32_t flux_limit_at(int32_t vbus_q15, int32_t w_q15);

/* By how much the voltage that is kept changes a current in a millisecond, in q. Any context. */
int32_t flux_limit_slew_q15(const struct tuning *t, int32_t vbus_q15);

/* The bridge goes off. */
void flux_limit_rest(struct flux_limit *s);

#endif
