/* SPDX-License-Identifier: MIT */
/* Processor checks that must pass before a motor may run: clock, stack guard, watchdog. Thread. */
#ifndef FIRMWARE_MONITOR_DEVICE_H
#define FIRMWARE_MONITOR_DEVICE_H

#include "firmware/fault/fault.h"

/* Forbids every access below the main stack; false if the core cannot. Once, early. */
bool device_guard_stack(void);

/* The first of FAULT_CLOCK, FAULT_STACK_GUARD, FAULT_WATCHDOG_OFF that applies now, or FAULT_NONE. Touches no fabric. */
enum fault device_fault(void);

/* After how long the watchdog resets a device whose program hangs, as the design has it; 0: it does not. */
uint32_t device_watchdog_ms(void);

#endif
