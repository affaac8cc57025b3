/* SPDX-License-Identifier: MIT */
/* What every thread request begins and ends with: firmware/axis/axis.h says how they work. */
#ifndef FIRMWARE_DRIVE_REQUESTS_H
#define FIRMWARE_DRIVE_REQUESTS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/config.h"
#include "firmware/settings/error.h"

struct axis;
struct tuning;

/* Twice what a live slow loop needs: each pass of the wait takes at least five cycles. */
#define REQUEST_TIMEOUT_POLLS (2u * BOARD_M3_HZ / CONFIG_SLOW_HZ / 5u)

/* Waits until the previous request has been taken; false if it never is. Thread. */
bool request_settled(const struct axis *a);

/* The slow loop runs before or after what is done between these two, never in between. The current loop runs on. */
uint32_t request_hold(void);
void request_release(uint32_t before);

/* What forbids switching the bridge on: the state, or a measurement beyond the limits of `t`. Thread. */
enum error drive_state_forbids_on(const struct axis *a);
struct outcome drive_measured_forbids_on(const struct axis *a, const struct tuning *t);

#endif
