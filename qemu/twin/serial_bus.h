/* SPDX-License-Identifier: GPL-2.0-or-later */
/* MMUART_1 and the RS-485 line behind it, with the time that characters take: QEMU's own UART sends in no time, so that neither
 * the transceiver's direction nor a reply's delay would mean anything there.
 *
 * A 16550 with FIFOs of 16 and the divisor's fraction (UG0331, MMUART chapter). A received character raises the interrupt at
 * once, whatever the FIFO's trigger level. Everybody on the line uses the rate and the format that the UART is set to. The
 * transceiver does not hear while it drives: what others send then is lost, and what is sent while it does not drive is
 * lost, too. A program at the character device is held back until 3.5 characters behind the drive's last.
 *
 * The log has a line for each thing that happens, in order: nanoseconds, what, and a byte in hexadecimal.
 *   rx BYTE    heard, its stop bit over          tx BYTE       sent, likewise
 *   deaf BYTE  not heard: the transceiver drove  unheard BYTE  not sent: it did not drive, or not to the end
 *   on, off    the transceiver's driver */
#ifndef TWIN_SERIAL_BUS_H
#define TWIN_SERIAL_BUS_H

#include <stdbool.h>
#include <stdint.h>

#define SERIAL_BUS_BASE  0x40010000u
#define SERIAL_BUS_BYTES 0x60u
#define SERIAL_BUS_PIN   0 /* of the MSS GPIO */

/* Either may be NULL: a character device of QEMU that is the rest of the line, and where the log goes. Ends the process with
 * one line if there is no such device, or the file cannot be written. Timers must be allowed. */
void serial_bus_open(const char *chardev_id, const char *log_path);

uint32_t serial_bus_read(void *unused, uint32_t offset);
void serial_bus_write(void *unused, uint32_t offset, uint32_t value);

/* The pin that switches the transceiver's driver. */
void serial_bus_drive(bool on);

/* Somebody else sends these bytes, hexadecimal without blanks, one behind the other; behind what he is still sending. */
void serial_bus_send(const char *hex);

void serial_bus_reset(void);
void serial_bus_flush(void);

#endif
