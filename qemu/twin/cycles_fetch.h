/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The fetch unit: words of 4 bytes one after the other into a buffer of three, filled anew at a branch's target. Where
 * memory answers at once it never holds the core up, except at the target, which the rules know (RULE_TARGET_SPLIT). */
#ifndef TWIN_CYCLES_FETCH_H
#define TWIN_CYCLES_FETCH_H

#include <stdbool.h>
#include <stdint.h>

/* Whether a word of eNVM may wait (cycles_cache.h says how long), and wait states of one of eSRAM. That one comes over the
 * system bus: two cycles at least, none while another is under way, and none while data are (TRM r2p1, bus interfaces). */
void cycles_fetch_init(bool envm_waits, unsigned esram_wait);
/* The cycles that the instruction, ready to execute at `now`, waits for its encoding: at a branch's target the ones
 * beyond the branch's own, */
uint64_t cycles_fetch_restart(uint32_t address, unsigned size, uint64_t now);
/* and in sequence. */
uint64_t cycles_fetch(uint32_t address, unsigned size, uint64_t now);

/* The instruction before has used the system bus for so long: code in eSRAM has not come meanwhile. */
void cycles_fetch_give_way(uint64_t cycles);

#endif
