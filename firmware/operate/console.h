/* SPDX-License-Identifier: MIT */
/* The line editor of the console: characters in, whole lines to commands.h. */
#ifndef FIRMWARE_OPERATE_CONSOLE_H
#define FIRMWARE_OPERATE_CONSOLE_H

#include <stdbool.h>
#include <stddef.h>

#include "firmware/operate/session.h"

#define CONSOLE_LINE_MAX 80u

struct console {
    struct session session;
    char line[CONSOLE_LINE_MAX + 1];
    size_t length;
    bool too_long;
    bool unprintable;
    bool incomplete; /* characters of this line were lost on the way */
    bool last_was_cr;
    uint32_t announced;              /* enum fault that has been said */
    uint32_t warned[REACTION_WORDS]; /* warnings that have been said */
};

/* Greets and prompts. Thread, once, when the axis has started. */
void console_start(struct console *k, const struct session *session);

/* Takes what has been received, carries out complete lines, and says once that a fault has been latched. Thread. */
void console_poll(struct console *k);

#endif
