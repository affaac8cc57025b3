/* SPDX-License-Identifier: MIT */
/*
 * A current loop in the midst of its work, without a motor: sensors stand still, so what they would show is put in through
 * the loop's own references, integrals and speed.
 */
#ifndef TESTS_BENCH_LOOP_STATE_H
#define TESTS_BENCH_LOOP_STATE_H

#include "firmware/control/current_loop.h"

/* Tuned as the drive is, bridge "on" as far as the loop knows, thresholds where nothing reaches them. Once. */
void loop_state_init(struct current_loop *c);

/* Any angle, any speed up to the limit, currents up to a quarter of the range. */
void loop_state_typical(struct current_loop *c);

/* Ends of all ranges; index 0...LOOP_STATE_EXTREMES-1. */
#define LOOP_STATE_EXTREMES 512u
void loop_state_extreme(struct current_loop *c, uint32_t index);

#endif
