/* SPDX-License-Identifier: MIT */
/* The watchdog, with whatever time-out the design has: refreshed, and left alone. Long waits sleep, which costs nothing. */
#include "drivers/cortex/cpu.h"
#include "drivers/cortex/nvic.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "tests/target/harness.h"
#include "tests/target/waiting.h"

#define WATCHDOG_US_TICKS (BOARD_WATCHDOG_HZ / 1000000u)

enum stage { POWER_ON, AFTER_WATCHDOG };

/* That share of the time-out. Interrupts are masked: the timer's wakes the core, and is not taken. */
static void sleep_percent(uint32_t percent)
{
    const uint32_t us = watchdog_timeout_ticks() / WATCHDOG_US_TICKS / 100u * percent;
    cpu_irq_disable();
    nvic_enable(MSS_IRQ_TIMER2);
    mss_timer2_start_once(us * US_TICKS);
    while (!nvic_is_pending(MSS_IRQ_TIMER2)) {
        cpu_wait_for_interrupt();
    }
    mss_timer2_acknowledge();
    nvic_disable(MSS_IRQ_TIMER2);
    cpu_irq_enable();
}

static void test_count(void)
{
    const uint32_t load = watchdog_timeout_ticks();
    waiting_begin();
    watchdog_refresh();
    wait_us(5u);
    const uint32_t early = watchdog_remaining_ticks();
    wait_us(1000u);
    const uint32_t late = watchdog_remaining_ticks();
    watchdog_refresh();
    wait_us(5u);
    const uint32_t refreshed = watchdog_remaining_ticks();
    harness_between("watchdog: near its load after a refresh", early, load - 20u * WATCHDOG_US_TICKS, load);
    harness_between("watchdog: counts down at its rate", early - late, 950u * WATCHDOG_US_TICKS,
                    1050u * WATCHDOG_US_TICKS);
    harness_between("watchdog: and back up", refreshed, load - 20u * WATCHDOG_US_TICKS, load);
}

static void test_watchdog(void)
{
    harness_true("watchdog: on, and resets", watchdog_resets());
    harness_note("watchdog: time-out, ms", watchdog_timeout_ticks() / (BOARD_WATCHDOG_HZ / 1000u));
    test_count();
    watchdog_refresh();
    sleep_percent(30u);
    watchdog_refresh();
    sleep_percent(98u);
    harness_true("watchdog: quiet while refreshed", true);
    harness_next_stage(AFTER_WATCHDOG);
    watchdog_refresh();
    sleep_percent(102u);
    harness_next_stage(POWER_ON);
    harness_true("watchdog: resets when it is not refreshed", false);
}

int main(void)
{
    if (harness_begin() == POWER_ON) {
        test_watchdog();
    } else {
        harness_equal("watchdog: reset, and the cause says so", harness_reset_cause(), SYSREG_CAUSE_WATCHDOG);
    }
    harness_end();
}
