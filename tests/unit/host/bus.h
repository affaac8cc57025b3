/* SPDX-License-Identifier: MIT */
/* The RS-485 line of a unit test: what the drive hears is a buffer, and so is what it sends. */
#ifndef TESTS_UNIT_HOST_BUS_H
#define TESTS_UNIT_HOST_BUS_H

#include "drivers/mss/rs485.h"

extern uint8_t host_bus_heard[4096], host_bus_sent[4096];
extern uint32_t host_bus_heard_bytes, host_bus_heard_taken, host_bus_sent_bytes;
extern uint32_t host_bus_marks;                 /* MMUART_RX_* of the next character */
extern uint32_t host_bus_opened;                /* times the line was opened, */
extern uint32_t host_bus_baud, host_bus_format; /* and how, last */

extern const uint32_t host_bus_silence_mark, host_bus_loss_mark;

/* Whether a UART is the line's. */
bool host_bus_is(const struct mmuart *u);

#endif
