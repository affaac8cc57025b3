/* SPDX-License-Identifier: MIT */
/*
 * Who tells the rotor's angle in operation, the saliency or the EMF: injection below, the flux observer above, by its margin of
 * observability (control/observer.h) and with hysteresis. Frame, angle, speed, voltages and integrals are the same for both, so
 * one store hands over; the observer's flux is set to what angle and currents say.
 */
#ifndef FIRMWARE_AXIS_INJECTION_LEAD_H
#define FIRMWARE_AXIS_INJECTION_LEAD_H

#include <stdbool.h>

struct axis;

/* Whether the injection leads now. Any context. */
bool injection_leads(const struct axis *a);

/* From injection to the observer where that sees enough. Slow loop, while injection leads, after the control. */
void injection_after_control(struct axis *a);

/* Whether the observer's tracking loop is too slow now, and the injection's is there. Slow loop, while the observer leads. */
bool injection_wants_back(const struct axis *a);

/* The observer sees too little: the injection leads from now on; false where there is none. Slow loop. */
bool injection_takes_over(struct axis *a);

/* Gains, after current_loop_follow(). Slow loop, while injection leads. */
void injection_lead_follow(struct axis *a);

/* Whether the axis with the small inductance is still the one believed. Slow loop, while injection leads. */
void injection_supervise(struct axis *a);

#endif
