/* SPDX-License-Identifier: MIT */
/*
 * The interrupts: their axes and priorities. The current loop has one handler per source of the angle, and
 * control/current_loop.h chooses; the slow loop is MSS timer 1, once a millisecond. Its clock comes from the same PLL as the
 * PWM, so the two never drift.
 */
#ifndef FIRMWARE_SYSTEM_HANDLERS_H
#define FIRMWARE_SYSTEM_HANDLERS_H

#include "firmware/control/current_loop.h"

/* Shuts the gates of every axis whose fabric is trusted. Any context; for a processor fault, which must not rely on RAM. */
void handlers_bridges_off(void);

/* What current_loop_select() chooses from. */
extern const struct loop_handlers handlers_of_axis_0;

/*
 * Lets a lost PLL lock or an uncorrectable memory error end the program. These interrupts have no handlers, so they enter as
 * faults do, at the current loop's priority. Thread, once.
 */
void handlers_watch_device(void);

/* Enable the current loop's interrupt, and the slow loop's, once the axis has started. Thread, once each. */
void handlers_start_current_loop(void);
void handlers_start_slow_loop(void);

/* Readies the scope of axis 0, before the slow loop starts. Thread, once. */
void handlers_start_scope(void);

/* The current loop's entry while a capture is under way: scoped_tick.S. */
void scoped_tick(void);

/* The current loop of axis 0 in C. The first is not in the table of handlers: the assembly version takes its place. */
void handlers_encoder_ab(void);
void handlers_weakening_ab(void);
void handlers_overmodulating_ab(void);
void handlers_forced_ab(void);
void handlers_observer_ab(void);
void handlers_injection_ab(void);
void handlers_hall_ab(void);

#endif
