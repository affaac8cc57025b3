/* SPDX-License-Identifier: MIT */
/* Start-up of the drive, and the thread: the console. Everything that moves the motor runs in interrupts. */
#include <stdbool.h>
#include <stdint.h>

#include "drivers/cortex/dwt.h"
#include "drivers/cortex/mpu.h"
#include "drivers/cortex/nvic.h"
#include "drivers/cortex/scb.h"
#include "drivers/mss/mmuart.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "firmware/operate/console.h"
#include "firmware/settings/config.h"
#include "firmware/system/axes.h"
#include "firmware/system/handlers.h"
#include "firmware/system/idle.h"
#include "firmware/system/postmortem.h"
#include "startup/startup.h"

int main(void);

void UART0_IRQHandler(void)
{
    mmuart0_irq_handler();
}

static void start_core(void)
{
    sysreg_enable_cache();
    scb_enable_faults();
    mpu_guard_stack((uint32_t)(uintptr_t)link_stack_guard_start,
                    (uint32_t)((uintptr_t)link_stack_limit - (uintptr_t)link_stack_guard_start));
    dwt_init();
    sysreg_release_reset(SYSREG_RESET_TIMER | SYSREG_RESET_MMUART0 | SYSREG_RESET_FIC0);
    watchdog_refresh();
}

static void start_uart(void)
{
    nvic_priority(BOARD_IRQ_CONSOLE, CONFIG_PRIORITY_CONSOLE);
    nvic_enable(BOARD_IRQ_CONSOLE);
    mmuart0_init(CONFIG_CONSOLE_BAUD);
}

/* What must be right before the fabric is touched, and what the last life of the program left behind. */
static enum fault check_boot(uint32_t reset_cause)
{
    const bool exception = postmortem_collect();
    if (!sysreg_clocks_match_board()) {
        return FAULT_CLOCK;
    }
    if (!gate_id_ok(&FABRIC0->gate)) {
        return FAULT_FABRIC;
    }
    if (exception) {
        return FAULT_EXCEPTION;
    }
    return (reset_cause & SYSREG_CAUSE_WATCHDOG) != 0u ? FAULT_WATCHDOG : FAULT_NONE;
}

int main(void)
{
    static struct console console;
    const uint32_t reset_cause = sysreg_reset_cause();
    start_core();
    axis_init(&axes[0], FABRIC0);
    axis_remember_heat(&axes[0], &axes_heat[0]);
    const enum fault boot_fault = check_boot(reset_cause);
    start_uart();
    handlers_start_current_loop();
    axis_start(&axes[0], boot_fault);
    handlers_start_slow_loop();
    console_start(&console, &axes[0]);
    for (;;) {
        console_poll(&console);
        axis_retry(&axes[0]);
        idle();
    }
}
