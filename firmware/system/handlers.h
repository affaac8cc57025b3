/* SPDX-License-Identifier: MIT */
/*
 * The motors of this device, and the interrupts with their priorities. Only main and the interrupts' handlers name a motor; all
 * other code gets a pointer. The current loop has one handler per source of the angle, and control/current_loop.h chooses; the
 * slow loop is MSS timer 1, once a millisecond for each axis. Its clock comes from the PWM's PLL, so the two never drift.
 */
#ifndef FIRMWARE_SYSTEM_HANDLERS_H
#define FIRMWARE_SYSTEM_HANDLERS_H

#include "firmware/drive/drive.h"
#include "firmware/scope/scope.h"

extern struct axis axes[AXIS_COUNT];
extern struct thermal_memory axes_heat[AXIS_COUNT]; /* a reset leaves it alone */
extern struct scope scope;                          /* the entries of two interrupts name it */

/* Called by a current loop's interrupt when a sample has a fault. */
void current_loop_fault(struct axis *axis);

/* Gates off for every axis whose fabric is trusted. Any context; for a processor fault: relies on no pointer in RAM. */
void handlers_bridges_off(void);

/* What current_loop_select() chooses from, for each axis. */
extern const struct loop_handlers handlers_of_axes[AXIS_COUNT];

/*
 * Enables the interrupts of a lost PLL lock and an uncorrectable memory error. They have no handlers, so they end the program
 * like a processor fault, at the current loop's priority. Thread, once.
 */
void handlers_watch_device(void);

/* Enable the interrupt of an axis's current loop, and the slow loop's, once all axes have started. Thread, once each. */
void handlers_start_current_loop(uint32_t axis);
void handlers_start_slow_loop(void);

/* Readies the scope, at axis 0, before the slow loop starts. Thread, once. */
void handlers_start_scope(void);

/* The current loop's entry during a capture: scoped_tick.S. */
void scoped_tick(void);

/* The current loops in C, of axis 0 and axis 1. encoder_ab is used with ripple compensation, otherwise the assembly. */
#define HANDLERS_DECLARED(name) \
    void handlers_##name(void); \
    void handlers_##name##_1(void);

HANDLERS_DECLARED(encoder_ab)
HANDLERS_DECLARED(weakening_ab)
HANDLERS_DECLARED(overmodulating_ab)
HANDLERS_DECLARED(forced_ab)
HANDLERS_DECLARED(observer_ab)
HANDLERS_DECLARED(injection_ab)
HANDLERS_DECLARED(hall_ab)

#endif
