/* SPDX-License-Identifier: MIT */
/* Called at the head of each basic block (-fsanitize-coverage=trace-pc), in place of tests/unit/host/interrupt.c. */
#include <string.h>

#include "adapter.h"
#include "engine.h"

#define THREAD_WAITS_BLOCKS 3000 /* no request takes as long before it asks whether the one before has been taken */

#define PLACES (1u << 22) /* more than the library has bytes */
#define PASSES 3          /* of a loop */

uint64_t hook_blocks;

static struct {
    bool (*interrupt)(int);
    bool (*masked)(void);
    int argument;
    uint64_t at;
    bool came;
} armed;

void __sanitizer_cov_trace_pc(void);

void hook_arm(bool (*interrupt)(int), int argument, uint64_t at, bool (*masked)(void))
{
    armed.interrupt = interrupt;
    armed.masked = masked;
    armed.argument = argument;
    armed.at = at;
    armed.came = false;
    hook_blocks = 0;
}

static struct {
    uint64_t *at;
    uint32_t most, count;
    uint8_t visits[PLACES];
} recorded;

void hook_record(uint64_t *at, uint32_t most)
{
    memset(&recorded, 0, sizeof recorded);
    recorded.at = at;
    recorded.most = most;
    hook_blocks = 0;
}

uint32_t hook_recorded(void)
{
    recorded.most = 0;
    return recorded.count;
}

static void record(uint32_t place)
{
    if (recorded.visits[place] < PASSES && recorded.count < recorded.most) {
        recorded.visits[place]++;
        recorded.at[recorded.count++] = hook_blocks;
    }
}

bool hook_came(void)
{
    const bool came = armed.came;
    armed.interrupt = 0;
    return came;
}

static bool slow_loop(int unused)
{
    (void)unused;
    return explore_slow_loop();
}

void hook_let_slow_loop_in(void)
{
    hook_arm(slow_loop, 0, THREAD_WAITS_BLOCKS, explore_masks_slow_loop);
}

static __attribute__((noinline)) void look_closer(uintptr_t place)
{
    bool (*const taken)(int) = armed.interrupt;
    if (recorded.most != 0u) {
        record((uint32_t)(place % PLACES));
    }
    if (taken != 0 && hook_blocks >= armed.at && !armed.masked()) {
        armed.interrupt = 0;
        armed.came = true;
        (void)taken(armed.argument);
    }
}

void __sanitizer_cov_trace_pc(void)
{
    hook_blocks++;
    if (*explore_watched[0] != *explore_watched[1]) {
        explore_look();
    }
    if (armed.interrupt != 0 || recorded.most != 0u) {
        look_closer((uintptr_t)__builtin_return_address(0));
    }
}
