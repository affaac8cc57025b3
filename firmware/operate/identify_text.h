/* SPDX-License-Identifier: MIT */
/* The results of identify as text. Thread. */
#ifndef FIRMWARE_OPERATE_IDENTIFY_TEXT_H
#define FIRMWARE_OPERATE_IDENTIFY_TEXT_H

#include "firmware/commission/identify.h"
#include "firmware/operate/text.h"

/* A line for each quantity: value, interval and unit, or why there is none; then how it ended. */
void identify_text_show(struct text *out, const struct identify *d);

/* A line while it runs: the step. */
void identify_text_running(struct text *out, const struct identify *d);

/* A line after its results have been adopted. */
void identify_text_used(struct text *out, int32_t changed);

#endif
