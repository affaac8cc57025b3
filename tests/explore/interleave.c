/* SPDX-License-Identifier: MIT */
/*
 * Interrupts between any two basic blocks: the current loop's, with and without a fault in its sample, in the slow loop, the
 * thread and its requests; the slow loop's in the thread and its requests. What must hold is what the explorer judges.
 */
#include <stdio.h>
#include <string.h>

#include "adapter.h"
#include "engine.h"

#define SHOWN_MOST     4 /* violations */
#define BLOCKS_MOST    (1u << 16)
#define PATIENT_BLOCKS 3000u

struct case_of {
    const struct examples *examples;
    int example, event;
    int kind; /* of the current loop's interrupt; -1: the slow loop's */
};

static uint64_t blocks;
static int shown;

static void restore(const struct case_of *k)
{
    memcpy(explore_memory, k->examples->memory[k->example], explore_bytes);
    explore_wrong = NULL;
}

static void act(const struct case_of *k)
{
    explore_events[k->event].act(explore_events[k->event].argument);
}

static bool slow_loop(int unused)
{
    (void)unused;
    const bool came = explore_slow_loop();
    if (came) {
        explore_judge_shown(); /* what the thread goes on from: the rest of the event may lead farther */
    }
    return came;
}

static void print(const struct case_of *k, uint64_t at)
{
    printf("\nVIOLATION: %s, by %s%s at block %llu of the last of\n", explore_wrong,
           k->kind < 0 ? "the slow loop" : "the current loop's interrupt, sample: ",
           k->kind < 0 ? "" : explore_interrupt_names[k->kind], (unsigned long long)at);
    engine_print_way(k->examples->node[k->example], k->event);
}

static void interrupt_at(const struct case_of *k, uint64_t at, struct totals *t)
{
    restore(k);
    if (k->kind < 0) {
        hook_arm(slow_loop, 0, at, explore_masks_slow_loop);
    } else {
        hook_arm(explore_interrupt, k->kind, at, explore_masks_all);
    }
    act(k);
    (void)hook_came();
    explore_judge();
    explore_settle();
    blocks++;
    if (explore_wrong != NULL) {
        t->violations++;
        if (shown++ < SHOWN_MOST) {
            print(k, at);
        }
    }
}

static void at_each_block(const struct case_of *k, uint32_t stride, struct totals *t)
{
    static uint64_t at[BLOCKS_MOST];
    restore(k);
    hook_record(at, BLOCKS_MOST);
    act(k);
    const uint32_t count = hook_recorded();
    restore(k);
    const bool waits = k->kind < 0 && explore_request_waits(); /* it comes before the thread loses its patience */
    for (uint32_t n = 0; n < count && (!waits || at[n] < PATIENT_BLOCKS); n += stride) {
        interrupt_at(k, at[n], t);
    }
}

static void interrupt_event(struct case_of *k, uint32_t stride, struct totals *t)
{
    if (!explore_is_slow_loop(k->event)) {
        k->kind = -1;
        at_each_block(k, stride, t);
    }
    if (!explore_is_request(k->event)) {
        for (k->kind = 0; explore_interrupt_names[k->kind] != NULL; k->kind++) {
            at_each_block(k, stride, t);
        }
    }
}

void interleave(int setup, const struct examples *e, uint32_t stride, struct totals *totals)
{
    blocks = 0;
    shown = 0;
    const uint64_t before = totals->violations;
    for (int example = 0; example < e->count; example++) {
        for (int event = 0; event < explore_event_count; event++) {
            struct case_of k = {.examples = e, .example = example, .event = event};
            const bool meant = explore_is_slow_loop(event) || explore_is_thread(event) || explore_is_request(event);
            restore(&k);
            if (meant && engine_may(event, explore_setups[setup].groups)) {
                interrupt_event(&k, stride, totals);
            }
        }
    }
    printf("  interrupted in %d states at %llu blocks, every %s%u: %llu violations\n", e->count,
           (unsigned long long)blocks, stride == 1u ? "" : "one in ", stride,
           (unsigned long long)(totals->violations - before));
    fflush(stdout);
}
