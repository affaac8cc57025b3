/* SPDX-License-Identifier: MIT */
/*
 * Chooses what gives the rotor's angle in operation, saliency or EMF: injection below, the flux observer above, by the margin
 * of observability (control/observer.h) with hysteresis. Both share frame, angle, speed, voltages and integrals, so one store
 * hands over; the observer's flux is set from angle and currents.
 */
#ifndef FIRMWARE_SOURCE_INJECTION_LEAD_H
#define FIRMWARE_SOURCE_INJECTION_LEAD_H

#include <stdbool.h>

struct axis;

/* From injection to the observer, if that sees enough. Slow loop, while injection leads, after the control. */
void injection_after_control(struct axis *a);

/* True if the observer's tracking loop is now too slow and injection is available. Slow loop, while the observer leads. */
bool injection_wants_back(const struct axis *a);

/* The observer sees too little: injection takes over; false if there is none. Slow loop. */
bool injection_takes_over(struct axis *a);

/* Gains, after current_loop_follow(). Slow loop, while injection leads. */
void injection_lead_follow(struct axis *a);

#endif
