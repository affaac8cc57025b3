/* SPDX-License-Identifier: MIT */
/* The watchdog: as the board's design has it, refreshed, and left alone. */
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "tests/target/harness.h"
#include "tests/target/waiting.h"

enum stage { POWER_ON, AFTER_WATCHDOG };

static void test_watchdog(void)
{
    harness_true("watchdog: on", watchdog_is_enabled());
    harness_equal("watchdog: time-out of the board's design", watchdog_timeout_ticks(), BOARD_WATCHDOG_LOAD_TICKS);
    harness_true("watchdog: as designed", watchdog_is_as_designed());
    watchdog_refresh();
    wait_us(5u);
    const uint32_t early = watchdog_remaining_ticks();
    wait_us(1000u);
    const uint32_t late = watchdog_remaining_ticks();
    watchdog_refresh();
    wait_us(5u);
    const uint32_t refreshed = watchdog_remaining_ticks();
    const uint32_t us_ticks = BOARD_WATCHDOG_HZ / 1000000u;
    harness_between("watchdog: near its load after a refresh", early, BOARD_WATCHDOG_LOAD_TICKS - 20u * us_ticks,
                    BOARD_WATCHDOG_LOAD_TICKS);
    harness_between("watchdog: counts down at its rate", early - late, 950u * us_ticks, 1050u * us_ticks);
    harness_between("watchdog: and back up", refreshed, BOARD_WATCHDOG_LOAD_TICKS - 20u * us_ticks,
                    BOARD_WATCHDOG_LOAD_TICKS);

    /* Refreshed in time it stays quiet for longer than its time-out; then it is left alone. */
    for (uint32_t ms = 0; ms < 150u; ms++) {
        watchdog_refresh();
        wait_us(1000u);
    }
    harness_true("watchdog: quiet while refreshed", true);
    harness_next_stage(AFTER_WATCHDOG);
    watchdog_refresh();
    wait_us(110000u);
    harness_next_stage(POWER_ON);
    harness_true("watchdog: resets when it is not refreshed", false);
}

int main(void)
{
    if (harness_begin() == POWER_ON) {
        waiting_begin();
        test_watchdog();
    } else {
        harness_equal("watchdog: reset, and the cause says so", harness_reset_cause(), SYSREG_CAUSE_WATCHDOG);
    }
    harness_end();
}
