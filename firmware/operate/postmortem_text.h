/* SPDX-License-Identifier: MIT */
#ifndef FIRMWARE_OPERATE_POSTMORTEM_TEXT_H
#define FIRMWARE_OPERATE_POSTMORTEM_TEXT_H

#include "firmware/operate/text.h"
#include "firmware/system/postmortem.h"

/* Prints the record of the processor fault before the last reset, if there is one. Thread. */
void postmortem_print(struct text *t, const struct postmortem *p);

#endif
