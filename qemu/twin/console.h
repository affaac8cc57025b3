/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A person at the serial console who types at 115200 baud. */
#ifndef TWIN_CONSOLE_H
#define TWIN_CONSOLE_H

/* Ends the process with one line if QEMU has no such character device. */
void console_attach(const char *chardev_id);
/* Queues the text and a carriage return. */
void console_type(const char *text);
/* Queues bytes, given as hexadecimal, and nothing behind them. Ends the process with one line if they are none. */
void console_keys(const char *hex);

#endif
