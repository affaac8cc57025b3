/* SPDX-License-Identifier: MIT */
/*
 * The console: characters in, whole lines to commands.h, and what happens is said between them.
 *
 * To people it echoes, prompts and helps to type (line.h, completion.h). To programs (`machine on`) it does none of that: each
 * line, an empty one too, is answered by its lines and one that is a '.'; an error is a line "error: ..."; what comes between
 * answers begins with "fault: " or "warning: ". A greeting there means that the processor has been reset.
 */
#ifndef FIRMWARE_OPERATE_CONSOLE_H
#define FIRMWARE_OPERATE_CONSOLE_H

#include <stdbool.h>

#include "firmware/operate/line.h"
#include "firmware/operate/session.h"

struct console {
    struct session session;
    struct line line;
    bool incomplete;                 /* characters of this line were lost on the way */
    uint32_t announced;              /* enum fault that has been said */
    uint32_t warned[REACTION_WORDS]; /* warnings that have been said */
};

/* Greets and prompts. Thread, once, when the axis has started. */
void console_start(struct console *k, const struct session *session);

/* Takes what has been received, carries out complete lines, and says once that a fault has been latched. Thread. */
void console_poll(struct console *k);

#endif
