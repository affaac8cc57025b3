/* SPDX-License-Identifier: MIT */
/* Common parts of the thread's requests (drive.h). */
#ifndef FIRMWARE_DRIVE_REQUESTS_H
#define FIRMWARE_DRIVE_REQUESTS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/config.h"
#include "firmware/settings/error.h"

struct axis;
struct tuning;

/* Two periods of the slow loop: each poll takes at least five cycles. */
#define REQUEST_TIMEOUT_POLLS (2u * BOARD_M3_HZ / CONFIG_SLOW_HZ / 5u)

/* Waits until the previous request has been taken; false on time-out. Thread. */
bool request_settled(const struct axis *a);

/* Masks the slow loop between these two; the current loop is not masked. */
uint32_t request_hold(void);
void request_release(uint32_t before);

/* What forbids switching the bridge on: the state, or a measurement beyond the limits of `t`. Thread. */
enum error drive_state_forbids_on(const struct axis *a);
struct outcome drive_measured_forbids_on(const struct axis *a, const struct tuning *t);

#endif
