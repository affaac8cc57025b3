/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The fetch unit: words of 4 bytes one after the other into a buffer of three, filled anew at a branch's target. Where
 * memory answers at once it never holds the core up, except at the target, which the rules know (RULE_TARGET_SPLIT). */
#ifndef TWIN_CYCLES_FETCH_H
#define TWIN_CYCLES_FETCH_H

#include <stdint.h>

/* Wait states of a word. */
void cycles_fetch_init(unsigned envm_wait, unsigned esram_wait);
/* The cycles that the instruction, ready to execute at `now`, waits for its encoding: at a branch's target the ones
 * beyond the branch's own, */
uint64_t cycles_fetch_restart(uint32_t address, unsigned size, uint64_t now);
/* and in sequence. */
uint64_t cycles_fetch(uint32_t address, unsigned size, uint64_t now);

#endif
