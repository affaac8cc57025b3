/* SPDX-License-Identifier: MIT */
/* Puts a tuning into effect for all that runs while the bridge is off. */
#ifndef FIRMWARE_DRIVE_ADOPT_H
#define FIRMWARE_DRIVE_ADOPT_H

struct axis;
struct tuning;

/* A new encoder scale voids what was learned in the old one. Slow loop, or thread while it is masked; bridge off. */
void adopt_tuning(struct axis *a, const struct tuning *t);

#endif
