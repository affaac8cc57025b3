/* SPDX-License-Identifier: MIT */
/* The CAN bus of a unit test: what the drive takes and what it sends are lists of frames. */
#ifndef TESTS_UNIT_HOST_CAN_H
#define TESTS_UNIT_HOST_CAN_H

#include "drivers/mss/can.h"

extern struct can_frame host_can_said[64], host_can_heard[4096]; /* to the drive; by the drive */
extern uint32_t host_can_saids, host_can_taken, host_can_heards;
extern uint32_t host_can_opened, host_can_closed, host_can_kbit, host_can_recovers;
extern uint32_t host_can_state; /* enum can_state, as the drive is told */
extern uint32_t host_can_cut;   /* nobody takes a frame */

#endif
