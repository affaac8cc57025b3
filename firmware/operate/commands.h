/* SPDX-License-Identifier: MIT */
/* The console's commands. */
#ifndef FIRMWARE_OPERATE_COMMANDS_H
#define FIRMWARE_OPERATE_COMMANDS_H

#include "firmware/operate/session.h"

/*
 * Carries out one line and prints the answer: lines of information, "ok", or one line "error: ..." after which nothing has
 * changed. Splits `line` in place. An empty line does nothing. Thread.
 */
void commands_execute(struct session *s, char *line);

#endif
