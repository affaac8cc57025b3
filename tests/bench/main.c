/* SPDX-License-Identifier: MIT */
/*
 * The benchmark: what each function costs, in the unit of the cycle counter. Started like the firmware, it needs the board
 * and its fabric, but no motor and no host: the table comes out of the console, 115200 8N1. The bridge stays off.
 */
#include <stddef.h>

#include "drivers/cortex/dwt.h"
#include "drivers/mss/cache.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "firmware/settings/config.h"
#include "firmware/system/handlers.h"
#include "startup/startup.h"
#include "tests/bench/kernels.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"

struct timing rows_timing;

void rows_print(const char *name)
{
    const struct timing_figures figures = timing_figures(&rows_timing);
    print_row(name, &figures, NULL);
}

struct timing_figures rows_over_vectors(timer_function timer, const struct vector_range *typical,
                                        const struct vector_range *extreme, uint32_t words)
{
    int32_t in[BENCH_KERNEL_WORDS];
    int32_t out[BENCH_KERNEL_WORDS];
    vector_restart();
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        vector_typical(in, typical, words);
        timing_add_typical(&rows_timing, timing_once(timer, in, out));
    }
    for (uint32_t i = 0; i < vector_extreme_count(words); i++) {
        vector_extreme(in, extreme, words, i);
        timing_add_extreme(&rows_timing, timing_once(timer, in, out));
    }
    return timing_figures(&rows_timing);
}

int main(void);

static void start(void)
{
    (void)cache_lock(link_code, link_array);
    sysreg_release_reset(SYSREG_RESET_TIMER | SYSREG_RESET_MMUART0 | SYSREG_RESET_FIC0);
    watchdog_refresh();
    print_start(CONFIG_CONSOLE_BAUD);
    drive_init(&axes[0], FABRIC0);
    handlers_start_current_loop(0u);
    drive_start(&axes[0], FAULT_NONE);
    adc_stop(&FABRIC0->adc); /* its interrupts come when a row asks for them */
    (void)gate_clear(&FABRIC0->gate, GATE_STATUS_LATCHES);
}

int main(void)
{
    const bool counting = dwt_init();
    start();
    print_text("\r\n# mssfoc " CONFIG_VERSION " benchmark, GCC " __VERSION__ "\r\n");
    print_text("# name                            min median    max\r\n");
    if (!counting || !sysreg_clocks_match_board() || !gate_id_ok(&FABRIC0->gate) ||
        axes[0].faults.cause != FAULT_NONE) {
        print_text("# the cycle counter, the clocks or the fabric are not what they should be\r\nbench: 0 rows\r\n");
        print_flush();
    } else {
        timing_init();
        print_note("two readings cost", timing_overhead());
        print_note("gate status", gate_status(&FABRIC0->gate));
        rows_arithmetic();
        rows_registers();
        rows_family();
        rows_current_loop();
        rows_scope();
        rows_slow_loop();
        rows_seldom();
        rows_interrupt();
        print_closing();
    }
    for (;;) {
        watchdog_refresh();
    }
}
