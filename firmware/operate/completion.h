/* SPDX-License-Identifier: MIT */
/*
 * Completes an unfinished line: names of commands, parameters and faults, and the words that a command accepts. They come from
 * the table of commands (commands_parts.h): an argument in capitals is a name of that kind, one in lower case, with '|'
 * between, is a word. Thread.
 */
#ifndef FIRMWARE_OPERATE_COMPLETION_H
#define FIRMWARE_OPERATE_COMPLETION_H

#include "firmware/operate/line.h"

/*
 * Extends the last word by what all matching names have in common, plus a blank if only one matches; lists them if nothing can
 * be added, and rings (BEL) if there are none. Returns true if it has listed: the caller prompts again.
 */
bool completion_of(struct line *l, struct text *out);

#endif
