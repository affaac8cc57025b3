/* SPDX-License-Identifier: MIT */
/* Processor checks that must pass before a motor may run: clock, stack guard, watchdog. Thread. */
#ifndef FIRMWARE_MONITOR_DEVICE_H
#define FIRMWARE_MONITOR_DEVICE_H

#include "firmware/fault/fault.h"

/* Protects the area below the main stack by the MPU; false if there is none. Once, early. */
bool device_guard_stack(void);

/*
 * The first of FAULT_CLOCK, FAULT_STACK_GUARD, FAULT_WATCHDOG_OFF that applies now, or FAULT_NONE. Accesses no fabric register.
 */
enum fault device_fault(void);

/* Time-out of the watchdog as configured in the design; 0: it does not reset. */
uint32_t device_watchdog_ms(void);

#endif
