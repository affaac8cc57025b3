/* SPDX-License-Identifier: MIT */
/*
 * The drive's state machine, in the terms of CiA 402 (IEC 61800-7-201), stepped once a millisecond.
 *
 * Commands come from the console (thread) as one word; the step carries them out. In "switched on" the drive works
 * through its start: currents at rest, then the bridge on and the rotor pulled to a known angle.
 */
#ifndef FIRMWARE_DRIVE_H
#define FIRMWARE_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/fault.h"
#include "firmware/tuning.h"

enum drive_state {
    DRIVE_NOT_READY,
    DRIVE_SWITCH_ON_DISABLED,
    DRIVE_READY,
    DRIVE_SWITCHED_ON,
    DRIVE_OPERATION_ENABLED,
    DRIVE_QUICK_STOP,
    DRIVE_FAULT_REACTION,
    DRIVE_FAULT,
};

enum drive_mode {
    DRIVE_MODE_SPEED,
    DRIVE_MODE_TORQUE,
};

enum drive_request {
    DRIVE_REQUEST_NONE,
    DRIVE_REQUEST_ON,
    DRIVE_REQUEST_OFF,
    DRIVE_REQUEST_QUICK_STOP,
    DRIVE_REQUEST_CLEAR,
};

#define DRIVE_STANDSTILL_RPM_Q4 (30 * 16) /* below this the motor counts as at rest */

struct drive {
    volatile uint32_t state; /* enum drive_state */
    volatile uint32_t fault; /* enum fault: the first cause, until cleared */
    uint32_t mode;           /* enum drive_mode */
    volatile uint32_t time_ms;
    volatile uint32_t request;      /* enum drive_request: the thread writes it, the slow loop takes it */
    volatile int32_t i_command_q15; /* of torque control */
    bool aligned;                   /* the encoder's relation to the magnets is known */
    struct tuning tuning;           /* of the last drive_switch_on() */
};

extern struct drive drive;

/* Leaves "not ready". `boot_fault` is what start-up found, or FAULT_NONE. Thread, once. */
void drive_start(enum fault boot_fault);

/* One step. Slow loop. */
void drive_step(void);

/*
 * The commands: thread. Each returns NULL when accepted, else one line that says why not and what to do; then nothing
 * has changed.
 */
const char *drive_switch_on(void);
const char *drive_switch_off(void);
const char *drive_quick_stop(void);
const char *drive_clear_fault(void);
const char *drive_command_speed(int32_t rpm);
const char *drive_command_current(int32_t milliamp);

/* Whether parameters may change now: the bridge is off and no start is under way. Thread. */
bool drive_is_off(void);

const char *drive_state_name(enum drive_state state);

#endif
