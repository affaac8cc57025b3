/* SPDX-License-Identifier: MIT */
/*
 * The scope's words: what each of its signals is, what a capture waits for, and what it has come to. Any context: constant
 * strings.
 */
#ifndef FIRMWARE_OPERATE_SIGNAL_TEXT_H
#define FIRMWARE_OPERATE_SIGNAL_TEXT_H

#include "firmware/scope/capture.h"

/* Of a name in signal_table; never NULL. */
const char *signal_text(const char *name);

/* The word of a command, and which it is: CAPTURE_NEVER if it is none of a level's. */
const char *scope_word_of_when(enum capture_when when);
enum capture_when scope_find_when(const char *word);

const char *scope_text_of_state(enum capture_state state);

/* Behind the state: " by a fault". */
const char *scope_text_of_cause(enum capture_cause cause);

#endif
