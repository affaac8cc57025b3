/* SPDX-License-Identifier: MIT */
/*
 * Set-points, each of which selects its mode. The thread checks one against the present state and leaves it here, in a mailbox
 * of one place: a later one replaces one that has not been taken yet. The slow loop takes it in its next step, if the drive is
 * still in operation.
 */
#ifndef FIRMWARE_DRIVE_SET_POINT_H
#define FIRMWARE_DRIVE_SET_POINT_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

struct set_point {
    volatile bool waits;
    uint8_t mode;  /* enum axis_mode */
    int32_t value; /* rpm, mA, counts, or an enum homing_method */
    bool relative; /* counts: to the last target, or to the shaft */
};

/* Slow loop, in operation. */
void set_point_take(struct axis *a);

#endif
