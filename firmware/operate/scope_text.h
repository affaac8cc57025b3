/* SPDX-License-Identifier: MIT */
/* What the console shows of the scope. Thread. */
#ifndef FIRMWARE_OPERATE_SCOPE_TEXT_H
#define FIRMWARE_OPERATE_SCOPE_TEXT_H

#include "firmware/operate/session.h"

/* Its signals, its trigger, and its progress. */
void scope_text_settings(struct session *s);

/* Every signal: its unit, its scale, and what it is. */
void scope_text_signals(struct session *s);

/*
 * A heading, the names, the scales, then a line of raw values per sample. A record overwritten while it is read is cut short:
 * its last line says how many there were.
 */
void scope_text_samples(struct session *s, enum scope_record record);

#endif
