/* SPDX-License-Identifier: MIT */
/* The motors of this device. Only main and the interrupt handlers name one; all other code gets a pointer. */
#ifndef FIRMWARE_SYSTEM_AXES_H
#define FIRMWARE_SYSTEM_AXES_H

#include "firmware/drive/drive.h"
#include "firmware/scope/scope.h"

extern struct axis axes[AXIS_COUNT];
extern struct thermal_memory axes_heat[AXIS_COUNT]; /* a reset leaves it alone */
extern struct scope scope;                          /* the entries of two interrupts name it */

/* A current loop's interrupt ends here when a sample has a fault. Only the interrupts call it. */
void current_loop_fault(struct axis *axis);

#endif
