/* SPDX-License-Identifier: MIT */
/* What the console shows of the scope. Thread. */
#ifndef FIRMWARE_OPERATE_SCOPE_TEXT_H
#define FIRMWARE_OPERATE_SCOPE_TEXT_H

#include "firmware/operate/session.h"

/* What it watches, what it waits for, and how far it is. */
void scope_text_settings(struct session *s);

/* Every signal there is: its unit, its scale, and what it is. */
void scope_text_signals(struct session *s);

/*
 * A heading, the names, the scales, then a line of raw values for each sample. A record that is overwritten while it is read
 * ends short: its last line says how many there were.
 */
void scope_text_samples(struct session *s, enum scope_record record);

#endif
