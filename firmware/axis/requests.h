/* SPDX-License-Identifier: MIT */
/* What every request of the thread begins and ends with: firmware/axis/axis.h says how they work. */
#ifndef FIRMWARE_AXIS_REQUESTS_H
#define FIRMWARE_AXIS_REQUESTS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/config.h"
#include "firmware/settings/error.h"

struct axis;
struct tuning;

/* Twice as long as a slow loop that lives takes: each turn of a wait is at least five cycles. */
#define REQUEST_PATIENCE_POLLS (2u * BOARD_M3_HZ / CONFIG_SLOW_HZ / 5u)

/* Waits until the request before this one has been taken; false if nobody takes it. Thread. */
bool request_settled(const struct axis *a);

/* What is checked and done between these two, the slow loop sees before or after, not in between. The current loop runs on. */
uint32_t request_hold(void);
void request_release(uint32_t before);

/* What forbids that the bridge goes on: the state, and what is measured, by the limits of `t`. Thread. */
enum error request_state_forbids_on(const struct axis *a);
struct outcome request_measured_forbids_on(const struct axis *a, const struct tuning *t);

/* The tuning is in effect for all that goes on while the bridge is off; another scale of the encoder voids what was learned in
 * the old one. Slow loop held, bridge off. */
void request_adopt(struct axis *a, const struct tuning *t);

#endif
