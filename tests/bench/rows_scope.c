/* SPDX-License-Identifier: MIT */
/* What the scope takes: from the current loop's interrupt while it is on, and beside it. */
#include <stddef.h>

#include "drivers/board.h"
#include "drivers/cortex/nvic.h"
#include "firmware/system/handlers.h"
#include "tests/bench/loop_state.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

static uint32_t with_sampler;

static void let_sampler(bool run)
{
    if (run) {
        nvic_enable(BOARD_IRQ_SCOPE);
    } else {
        nvic_disable(BOARD_IRQ_SCOPE);
        nvic_clear_pending(BOARD_IRQ_SCOPE);
    }
}

/* Eight signals, and a trigger that never comes. */
static void arm(void)
{
    scope_off(&scope);
    (void)scope_set_trigger(&scope, scope.trigger_on, CAPTURE_RISES, INT32_MAX);
    (void)scope_arm(&scope);
    scope.capture.filled = scope.capture.samples; /* the trigger is looked at */
}

/* The same interrupt with the scope's entry in the vector, less the one with the handler there. */
static uint32_t taken(bool sampled)
{
    let_sampler(sampled);
    arm();
    const uint32_t with = rows_time_interrupt(BOARD_IRQ_ADC);
    scope_off(&scope);
    let_sampler(true);
    return with - rows_time_interrupt(BOARD_IRQ_ADC);
}

static void row(const char *name, uint32_t sampled)
{
    with_sampler = sampled;
    vector_restart();
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        loop_state_typical(&axes[0].loop);
        timing_add_typical(&rows_timing, taken(with_sampler != 0u));
    }
    rows_print(name);
}

TIMING_FUNCTION(time_step, scope_step(&scope))

static void row_recorder(void)
{
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        timing_add_typical(&rows_timing, timing_once(time_step, NULL, NULL));
    }
    rows_print("scope.recorder");
}

void rows_scope(void)
{
    print_heading("scope: in the current loop's interrupt, beside it, and once a millisecond");
    handlers_start_scope();
    row("scope.tick", 0u);
    row("scope.sampled", 1u);
    row_recorder();
}
