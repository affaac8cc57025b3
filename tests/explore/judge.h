/* SPDX-License-Identifier: MIT */
/* What must hold in every state of an axis, whoever plays it: the explorer and the swarm. */
#ifndef TESTS_EXPLORE_JUDGE_H
#define TESTS_EXPLORE_JUDGE_H

#include "firmware/drive/drive.h"
#include "firmware/operate/cia402.h"

/* NULL, or what must not be: a latched fault beside live gates, a set-point beyond its limit in effect. */
const char *judge_axis(const struct axis *a, bool live);

/* The state that a bus shows; and NULL, or the change since `before` that CiA 402 does not have. */
uint32_t judge_state_shown(const struct cia402 *c, const struct axis *a);
const char *judge_shown(uint32_t *before, const struct cia402 *c, const struct axis *a);

#endif
