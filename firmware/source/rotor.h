/* SPDX-License-Identifier: MIT */
/*
 * The rotor's position and speed, and whether they are known, for every source of the angle. The current loop has the angle and
 * the electrical speed (current_loop_angle_q32(), current_loop_w_q15()); the speed loop and its supervision take the shaft
 * speed from here.
 *
 *   encoder       edges and their times (control/speed_estimate.h)
 *   observer      speed of its tracking loop; the speed loop's gains are reduced to its bandwidth
 *   Hall switches edges and their times (control/hall.h), the speed loop's gains as with the observer
 *   none of them  the speed of the prescribed field (I-f) that the rotor follows
 */
#ifndef FIRMWARE_SOURCE_ROTOR_H
#define FIRMWARE_SOURCE_ROTOR_H

#include <stdbool.h>

#include "firmware/axis/axis.h"
#include "firmware/settings/features.h"

/* True if an encoder gives the angle. Any context. */
static inline bool rotor_has_encoder(const struct axis *a)
{
    return source_has(a->tuning.angle_source, SOURCE_COUNTS);
}

/* True if Hall switches do. Any context. */
static inline bool rotor_has_hall(const struct axis *a)
{
    return source_has(a->tuning.angle_source, SOURCE_SWITCHES);
}

/* True if neither does: the observer, or a field that the rotor follows. Any context. */
static inline bool rotor_is_sensorless(const struct axis *a)
{
    return source_has(a->tuning.angle_source, SOURCE_ESTIMATES);
}

/* True if the rotor's angle is known, not just that of a field it should follow. Any context. */
static inline bool rotor_is_known(const struct axis *a)
{
    return rotor_has_encoder(a) ? a->start.aligned : a->loop.field_follows != 0u;
}

/* True if injection gives the angle now. Any context. */
static inline bool injection_leads(const struct axis *a)
{
    return FEATURE_IN(INJECTION) && a->loop.source == LOOP_INJECTION;
}

/* Measures the speed by an encoder. Slow loop, first, whatever the state. */
void rotor_count(struct axis *a);

/* The same from another source. Slow loop, first, whatever the state. */
void rotor_take_speed(struct axis *a);

#endif
