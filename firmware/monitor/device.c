/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/device.h"

#include "drivers/cortex/mpu.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "startup/startup.h"

static uint32_t guard_base(void)
{
    return (uint32_t)(uintptr_t)link_stack_guard_start;
}

static uint32_t guard_bytes(void)
{
    return (uint32_t)((uintptr_t)link_stack_limit - (uintptr_t)link_stack_guard_start);
}

bool device_guard_stack(void)
{
    return mpu_guard_stack(guard_base(), guard_bytes());
}

enum fault device_fault(void)
{
    if (!sysreg_clocks_match_board() || !sysreg_plls_locked()) {
        return FAULT_CLOCK;
    }
    if (!mpu_guards(guard_base(), guard_bytes())) {
        return FAULT_STACK_GUARD;
    }
    return watchdog_resets() ? FAULT_NONE : FAULT_WATCHDOG_OFF;
}

uint32_t device_watchdog_ms(void)
{
    return watchdog_resets() ? watchdog_timeout_ticks() / (BOARD_WATCHDOG_HZ / 1000u) : 0u;
}
