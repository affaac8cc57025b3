/* SPDX-License-Identifier: MIT */
/* Breadth first through all that can happen, and back along the shortest way to what must not. */
#ifndef TESTS_EXPLORE_ENGINE_H
#define TESTS_EXPLORE_ENGINE_H

#include <stdbool.h>
#include <stdint.h>

#define EXAMPLES_MOST 64

/* States worth an interruption at every block: the first of each place. */
struct examples {
    int count;
    uint32_t node[EXAMPLES_MOST];
    uint8_t *memory[EXAMPLES_MOST];
};

struct totals {
    uint64_t states, transitions, violations;
};

/* Explores a setup to its end, or to this many states (0: to the end), and prints what it found. */
void engine_explore(int setup, uint64_t most, struct totals *totals, struct examples *examples);

/* Whether an event of these groups can happen now. */
bool engine_may(int event, uint32_t groups);

/* The events that lead from the first state to a node, and one more, a line each; -1: none. */
void engine_print_way(uint32_t node, int event);

/* Plays events by name from a setup's first state, and prints where each leads; false: there is no such event. */
bool engine_play(int setup, char **names);

/* ---- the hook at every block: hook.c ---- */

/* From block `at` on, once the interrupt may come, it comes. */
void hook_arm(bool (*interrupt)(int), int argument, uint64_t at, bool (*masked)(void));
/* Whether it has come; disarms it. */
bool hook_came(void);
/* The slow loop comes if the thread waits for it: it has not been armed otherwise. */
void hook_let_slow_loop_in(void);
extern uint64_t hook_blocks; /* passed so far */

/* Notes the numbers of the blocks that are passed from now on, of a loop's those of the first passes; returns how many. */
void hook_record(uint64_t *at, uint32_t most);
uint32_t hook_recorded(void);

/* ---- interleave.c ---- */

/* Interrupts events in these states of a setup at every `stride`-th block. */
void interleave(int setup, const struct examples *e, uint32_t stride, struct totals *totals);

#endif
