/* SPDX-License-Identifier: MIT */
/*
 * Where the rotor stands, how fast it turns, and whether that is known: one place, whatever tells it. The current loop has the
 * angle and the electrical speed (current_loop_angle_q32(), current_loop_w_q15()); the speed loop and all that watches it take
 * the speed of the shaft from here.
 *
 *   encoder       the edges and their times (control/speed_estimate.h)
 *   observer      its speed, as quick as its tracking loop: the speed loop's gains go down with that
 *   Hall switches their edges and the times of these (control/hall.h), the speed loop's gains as with the observer
 *   none of them  a field is prescribed and the rotor hangs on it: its speed, for want of a better one
 */
#ifndef FIRMWARE_AXIS_ROTOR_H
#define FIRMWARE_AXIS_ROTOR_H

#include <stdbool.h>

#include "firmware/axis/axis.h"
#include "lib/usually.h"

/* Whether an encoder tells the angle. Any context. */
static inline bool rotor_has_encoder(const struct axis *a)
{
    return a->tuning.angle_source == PARAM_ANGLE_ENCODER;
}

/* Whether Hall switches do. Any context. */
static inline bool rotor_has_hall(const struct axis *a)
{
    return a->tuning.angle_source == PARAM_ANGLE_HALL;
}

/* Whether the angle is known, and not only that of a field on which the rotor should hang. Any context. */
static inline bool rotor_is_known(const struct axis *a)
{
    return rotor_has_encoder(a) ? a->start.aligned : a->loop.field_follows != 0u;
}

/* The speed, where no encoder tells it. Slow loop. */
void rotor_take_speed(struct axis *a);

/* Measures the speed. Slow loop, first, whatever the state. */
static inline void rotor_measure(struct axis *a)
{
    if (USUALLY(rotor_has_encoder(a))) {
        speed_loop_measure(&a->speed, &a->fabric->encoder, &a->tuning);
    } else {
        rotor_take_speed(a);
    }
}

#endif
