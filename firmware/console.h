/* SPDX-License-Identifier: MIT */
/* The line editor of the console: characters in, whole lines to commands.h. */
#ifndef FIRMWARE_CONSOLE_H
#define FIRMWARE_CONSOLE_H

/* Prints the first prompt. Thread, once. */
void console_start(void);

/* Takes what has been received and carries out complete lines. Thread; returns when nothing is waiting. */
void console_poll(void);

#endif
