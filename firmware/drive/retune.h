/* SPDX-License-Identifier: MIT */
/* The only writer of an axis' tuning. */
#ifndef FIRMWARE_DRIVE_RETUNE_H
#define FIRMWARE_DRIVE_RETUNE_H

#include <stdint.h>

struct axis;
struct tuning;

/* The whole tuning, with the speed loop. Slow loop, or thread while it is masked; bridge off. */
void retune_all(struct axis *a, const struct tuning *t);

/* Another source of the angle, with the least integral gain that its resolution asks for. Slow loop, in operation. */
void retune_source(struct axis *a, uint32_t angle_source, int32_t speed_ki_min_q16);

/* Reduces the speed loop's gains to 0.7, the integral gain to 0.5: slower, with the same damping. Slow loop. */
void retune_reduced_gains(struct axis *a);

/*
 * Puts a tuning into effect while the bridge is off. A new encoder scale invalidates what was learned in the old one. Slow
 * loop, or thread while it is masked; bridge off.
 */
void apply_tuning(struct axis *a, const struct tuning *t);

#endif
