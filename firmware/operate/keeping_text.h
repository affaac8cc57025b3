/* SPDX-License-Identifier: MIT */
/* Messages about stored settings: at the start, and by `load` and `save`. Thread. */
#ifndef FIRMWARE_OPERATE_KEEPING_TEXT_H
#define FIRMWARE_OPERATE_KEEPING_TEXT_H

#include "firmware/drive/keeping.h"
#include "firmware/operate/text.h"

/* Which slot, which save, what was skipped, is missing or damaged; or why there is none, or none in effect. */
void keeping_text_loaded(struct text *t, const struct kept *k);

/* Which slots are damaged, if any. */
void keeping_text_damage(struct text *t, const struct slots_view *v);

/* The slot, and how often pages have been written so far. */
void keeping_text_saved(struct text *t, const struct saved *s);

#endif
