/* SPDX-License-Identifier: MIT */
/*
 * The console: passes whole lines to commands.h, and reports events between answers.
 *
 * For people it echoes, prompts, edits and completes (line.h, arguments.c). For programs (`machine on`) it does not: each line,
 * even an empty one, is answered by lines and a final '.'; an error is a line "error: ..."; an event between answers begins
 * with "fault: ", "warning: " or "done: ". A greeting means that the processor has been reset.
 */
#ifndef FIRMWARE_OPERATE_CONSOLE_H
#define FIRMWARE_OPERATE_CONSOLE_H

#include <stdbool.h>

#include "firmware/operate/commands.h"

struct console {
    struct session session;
    struct line line;
    bool incomplete;                          /* characters of this line were lost */
    uint32_t announced[AXIS_COUNT];           /* enum fault last reported */
    uint32_t stopped_by[AXIS_COUNT];          /* enum owner last reported */
    uint32_t warned[AXIS_COUNT][FAULT_WORDS]; /* warnings already reported */
};

/* Greets and prompts. Thread, once, when the axis has started. */
void console_start(struct console *k, const struct session *session);

/* Handles received characters, carries out a complete line, and reports events. True: call again. Thread. */
bool console_poll(struct console *k);

#endif
