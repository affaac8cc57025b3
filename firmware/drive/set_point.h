/* SPDX-License-Identifier: MIT */
/*
 * Set-points, each of which selects its mode. The thread checks one against the present state and leaves it here, in a mailbox
 * of one place: a later one replaces one that has not been taken yet. Only of the cyclic modes two may come within a step,
 * where the master's clock is a little faster: the one before stays beside it. The slow loop takes what is there in its next
 * step, if the drive is still in operation.
 */
#ifndef FIRMWARE_DRIVE_SET_POINT_H
#define FIRMWARE_DRIVE_SET_POINT_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

struct set_point {
    volatile bool waits;
    uint8_t mode;          /* enum axis_mode */
    int32_t value;         /* rpm, mA, an enum homing_method; or counts, of which there are more bits in the drive */
    bool relative;         /* pp: from the last target, or the shaft, not to `value`; in any case so far beyond: */
    int64_t by;            /* counts */
    bool second;           /* of a cyclic mode: the one before waits, too */
    int32_t first;         /* its value, */
    uint32_t at, first_at; /* and the conversions at which they came */
};

/* Slow loop, in operation. */
void set_point_take(struct axis *a);

#endif
