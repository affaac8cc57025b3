/* SPDX-License-Identifier: MIT */
/*
 * One mode of operation, as modes.c calls it. A new one is a file with such a structure, a value of enum axis_mode, and a line
 * in the table of modes.c.
 */
#ifndef FIRMWARE_DRIVE_MODE_H
#define FIRMWARE_DRIVE_MODE_H

#include "firmware/axis/axis.h"

struct mode {
    bool needs_encoder;
    bool needs_sensor; /* an encoder or Hall switches: its step leads no field, nor tells the observer of the ramp */
    struct outcome (*check)(const struct axis *a, int32_t value); /* of a set-point; slow loop held. Thread */
    void (*enter)(struct axis *a);                                /* from any other, bumpless; may be NULL. Slow loop */
    void (*aim)(struct axis *a, const struct set_point *s);       /* at a set-point, once entered. Slow loop */
    const struct set_point *(*step)(
        struct axis *a); /* a millisecond; the set-point to go on with, or NULL. Slow loop */
};

extern const struct mode mode_speed, mode_torque, mode_position, mode_homing, mode_cyclic_position, mode_cyclic_speed,
    mode_cyclic_torque, mode_learning;

/* For checks: refused with the limit if beyond +-limit. */
static inline struct outcome mode_within(int32_t x, int32_t limit, enum error error)
{
    return x > limit || x < -limit ? (struct outcome){error, limit} : OUTCOME_OK;
}

/* A set-point of a cyclic mode, which may begin between two steps (control/cyclic.h). Slow loop. */
void mode_aim_cyclic(struct axis *a, const struct set_point *s, int64_t target);

/* What the speed loop may ask for beside the feed-forward torque, which is returned (modes.c). Slow loop. */
int32_t mode_room_beside_known(struct axis *a, struct interval *room);

#endif
