/* SPDX-License-Identifier: MIT */
/* What must hold of the processor's side before a motor may run: clock, stack guard, watchdog. Thread. */
#ifndef FIRMWARE_AXIS_DEVICE_H
#define FIRMWARE_AXIS_DEVICE_H

#include "firmware/axis/fault.h"

/* Forbids every access below the main stack; false where the core cannot. Once, early. */
bool device_guard_stack(void);

/* FAULT_CLOCK, FAULT_STACK_GUARD, FAULT_WATCHDOG_OFF: the first that is so now; or FAULT_NONE. Touches no fabric. */
enum fault device_fault(void);

#endif
