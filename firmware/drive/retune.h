/* SPDX-License-Identifier: MIT */
/* The only writer of an axis' tuning. */
#ifndef FIRMWARE_DRIVE_RETUNE_H
#define FIRMWARE_DRIVE_RETUNE_H

#include <stdint.h>

struct axis;
struct tuning;

/* All of it, and the speed loop by it. Slow loop, or thread while it is masked; bridge off. */
void retune_to(struct axis *a, const struct tuning *t);

/* Another source of the angle, with the least integral gain that its resolution asks for. Slow loop, in operation. */
void retune_source(struct axis *a, uint32_t angle_source, int32_t speed_ki_min_q16);

/* The speed loop with gains of 0.7, its memory with 0.5: it becomes slower but keeps its damping. Slow loop. */
void retune_softened(struct axis *a);

/*
 * A tuning for all that runs while the bridge is off. A new encoder scale voids what was learned in the old one. Slow loop, or
 * thread while it is masked; bridge off.
 */
void adopt_tuning(struct axis *a, const struct tuning *t);

#endif
