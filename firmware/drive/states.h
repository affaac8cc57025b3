/* SPDX-License-Identifier: MIT */
/*
 * The drive's state machine, named as in CiA 402 (IEC 61800-7-201): one table of state, event, guard, action and next state. A
 * state's work in each millisecond returns an event, too. docs/states.md is drawn from the table.
 *
 * Requests were checked when made; if a fault or the end of a stop has changed the state since, an event without a row for the
 * new state is ignored.
 */
#ifndef FIRMWARE_DRIVE_STATES_H
#define FIRMWARE_DRIVE_STATES_H

#include <stdbool.h>

struct axis;

enum drive_event {
    DRIVE_EVENT_NONE,
    DRIVE_EVENT_BOOTED,     /* start-up trusts the fabric */
    DRIVE_EVENT_UNTRUSTED,  /* it does not */
    DRIVE_EVENT_ON,         /* requests: `on`, */
    DRIVE_EVENT_IDENTIFY,   /* `identify`, */
    DRIVE_EVENT_LEARN_HALL, /* `learn hall`, */
    DRIVE_EVENT_OFF,
    DRIVE_EVENT_QUICK_STOP,
    DRIVE_EVENT_CLEAR,
    DRIVE_EVENT_SOURCE,     /* a hand-over to another source of the angle */
    DRIVE_EVENT_STARTING,   /* the settings are in effect */
    DRIVE_EVENT_STARTED,    /* the start sequence is through */
    DRIVE_EVENT_STOPPED,    /* standstill, or the stop has timed out */
    DRIVE_EVENT_FAULT_STOP, /* a fault is latched whose reaction is a controlled stop */
    DRIVE_EVENT_FAULT,      /* a fault is latched */
    DRIVE_EVENT_GATES_SHUT, /* and the gates are off */
};

/* Takes the first row for the present state whose guard holds; false if there is none. Slow loop; thread before it runs. */
bool states_take(struct axis *a, enum drive_event event);

/* One millisecond: a latched fault, a request, then what the state does. Slow loop. */
void states_step(struct axis *a);

/* True if the motor is under control: in operation, or braking. Any context. */
bool states_are_running(const struct axis *a);

#endif
