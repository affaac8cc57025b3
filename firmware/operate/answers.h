/* SPDX-License-Identifier: MIT */
/* How a command answers: its error in one line, values with their units. All append to s->out. Thread. */
#ifndef FIRMWARE_OPERATE_ANSWERS_H
#define FIRMWARE_OPERATE_ANSWERS_H

#include "firmware/operate/session.h"

/* "error: WORD: what" */
void answer_about(struct session *s, const char *word, const char *what);

/* A line. In the text '@' stands for the first value, '#' for the second. */
void answer_filled(struct session *s, const char *text, int32_t first, int32_t second);

/* "ok", or "error: " and why. */
void answer(struct session *s, struct outcome outcome);

/* "name1.234unit": a Q15 fraction of range_milli, in units; `name` and `unit` include their blanks. */
void answer_milli(struct session *s, const char *name, int32_t q15, int32_t range_milli, const char *unit);

/* The same in rpm. */
void answer_rpm(struct session *s, const char *name, int32_t rpm_q4);

#endif
