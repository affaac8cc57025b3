/* SPDX-License-Identifier: MIT */
/*
 * The benchmark: what each function costs, in the unit of the cycle counter. Started like the firmware, it needs the board
 * and its fabric, but no motor and no host: the table comes out of the console, 115200 8N1. The bridge stays off.
 */
#include "drivers/cortex/dwt.h"
#include "drivers/fabric/adc.h"
#include "drivers/fabric/gate.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "firmware/config.h"
#include "firmware/drive.h"
#include "firmware/params.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"

struct timing rows_timing;

int main(void);

static void start(void)
{
    sysreg_enable_cache();
    sysreg_release_reset(SYSREG_RESET_TIMER | SYSREG_RESET_MMUART0 | SYSREG_RESET_FIC0);
    watchdog_refresh();
    print_start(CONFIG_CONSOLE_BAUD);
    params_init();
    drive_start(FAULT_NONE);
    adc_stop(); /* its interrupts come when a row asks for them */
    (void)gate_clear(GATE_STATUS_LATCHES);
}

int main(void)
{
    const bool counting = dwt_init();
    start();
    print_text("\r\n# mssfoc " CONFIG_VERSION " benchmark, GCC " __VERSION__ "\r\n");
    print_text("# name                            min median    max\r\n");
    if (!counting || !sysreg_clocks_match_board() || !gate_id_ok() || drive.fault != FAULT_NONE) {
        print_text("# the cycle counter, the clocks or the fabric are not what they should be\r\nbench: 0 rows\r\n");
        print_flush();
    } else {
        timing_init();
        print_note("two readings cost", timing_overhead());
        print_note("gate status", gate_status());
        rows_arithmetic();
        rows_current_loop();
        rows_slow_loop();
        rows_seldom();
        rows_interrupt();
        rows_control();
        print_closing();
    }
    for (;;) {
        watchdog_refresh();
    }
}
