/* SPDX-License-Identifier: MIT */
/*
 * A half-duplex line: an MMUART behind an RS-485 transceiver whose driver a GPIO pin switches.
 *
 * The driver is on from before the first start bit until the last stop bit has left. The UART has no interrupt for the latter,
 * only LSR.TEMT. MSS timer 2 polls it when the last character should be under way, and then every quarter of a character until
 * it is set, in interrupt context: the thread may be busy meanwhile. While listening, the same timer measures the silence after
 * each character: a character after more than 3.5 characters' time is marked (MMUART_RX_SILENCE).
 *
 * While driving, it hears nothing. What arrives within two characters' time after that, where senders must wait 3.5, is the
 * tail of something sent meanwhile, not a beginning: its first character is marked as next to a loss.
 */
#ifndef DRIVERS_MSS_RS485_H
#define DRIVERS_MSS_RS485_H

#include "drivers/mss/mmuart.h"

struct rs485 {
    struct mmuart uart;
    uint32_t pin;             /* of the MSS GPIO: high switches the driver on */
    uint32_t character_ticks; /* of BOARD_MSS_TIMER_HZ: start, eight bits, parity or a second stop bit, stop bit */
    volatile bool settling;   /* it has just released the line */
    volatile bool driving;
    volatile bool whole; /* the thread has no more characters for this transmission */
};

/*
 * Opens the UART, with the line released. The caller enables both interrupts in the NVIC, at one priority, and has their
 * handlers call those below. False if the rate does not fit (mmuart_open()). Context: thread.
 */
bool rs485_open(struct rs485 *r, struct mmuart_regs *regs, uint32_t pin, uint32_t baud, enum mmuart_format format);

/* Sends `count` bytes, then releases the line. Range: 2...MMUART_TX_BYTES; not while sending. Thread. */
void rs485_send(struct rs485 *r, const uint8_t *bytes, size_t count);

/* True if the line is still driven. Any context. */
static inline bool rs485_is_sending(const struct rs485 *r)
{
    return r->driving;
}

/* Context: the UART's interrupt, and timer 2's. */
void rs485_uart_handler(struct rs485 *r);
void rs485_timer_handler(struct rs485 *r);

#endif
