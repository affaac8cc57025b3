/* SPDX-License-Identifier: MIT */
/*
 * What may stand at the end of a line that is not finished: names of commands, of parameters and faults, and the words of which
 * a command takes one. They come from the table of commands (commands_parts.h): an argument in capitals is a name of that
 * sort, one in small letters, with '|' between, is a word. Thread.
 */
#ifndef FIRMWARE_OPERATE_COMPLETION_H
#define FIRMWARE_OPERATE_COMPLETION_H

#include "firmware/operate/line.h"

/*
 * Adds to the line what all the names have in common that begin like its last word, and a blank if it is only one; lists them
 * when nothing can be added, and says so (BEL) when there are none. Returns whether it has listed: the caller prompts again.
 */
bool completion_of(struct line *l, struct text *out);

#endif
