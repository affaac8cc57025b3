/* SPDX-License-Identifier: MIT */
/* The line editor of the console: characters in, whole lines to commands.h. */
#ifndef FIRMWARE_CONSOLE_H
#define FIRMWARE_CONSOLE_H

/* Prints the prompt, with what has been typed so far. Thread. */
void console_prompt(void);

/* Takes what has been received and carries out complete lines. Thread; returns when nothing is waiting. */
void console_poll(void);

#endif
