/* SPDX-License-Identifier: MIT */
/* The motors of this device. Only main and the interrupt handlers name one; all other code gets a pointer. */
#ifndef FIRMWARE_SYSTEM_AXES_H
#define FIRMWARE_SYSTEM_AXES_H

#include "firmware/drive/drive.h"
#include "firmware/scope/scope.h"

/*
 * The interrupt's assembly acknowledges a conversion by storing the first axis's address and 1 to ADC.STATUS: the address must
 * have none of the bits that clear something.
 */
#define AXES_ALIGNMENT 512

extern struct axis axes[AXIS_COUNT];
extern struct thermal_memory axes_heat[AXIS_COUNT]; /* a reset leaves it alone */
extern struct scope scope;                          /* of the first axis: the entries of two interrupts name it */

/* The current loop's interrupt ends here when a sample has a fault. Only the interrupt calls it. */
void current_loop_fault(void);

#endif
