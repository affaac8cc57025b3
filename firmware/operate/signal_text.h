/* SPDX-License-Identifier: MIT */
/*
 * The scope's words: what each signal is, what a capture waits for, and its state. Any context: constant strings.
 */
#ifndef FIRMWARE_OPERATE_SIGNAL_TEXT_H
#define FIRMWARE_OPERATE_SIGNAL_TEXT_H

#include "firmware/scope/capture.h"

/* Of a name in signal_table; never NULL. */
const char *signal_text(const char *name);

/* The command word of a trigger condition, and the reverse: CAPTURE_NEVER if it is not one for a level. */
const char *scope_word_of_when(enum capture_when when);
enum capture_when scope_find_when(const char *word);

const char *scope_text_of_state(enum capture_state state);

/* Appended to the state: " by a fault". */
const char *scope_text_of_cause(enum capture_cause cause);

#endif
