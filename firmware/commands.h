/* SPDX-License-Identifier: MIT */
/* The console's commands. */
#ifndef FIRMWARE_COMMANDS_H
#define FIRMWARE_COMMANDS_H

/*
 * Carries out one line and prints the answer: lines of information, "ok", or one line "error: ..." after which nothing has
 * changed. Splits `line` in place. An empty line does nothing. Thread.
 */
void commands_execute(char *line);

#endif
