/* SPDX-License-Identifier: MIT */
/*
 * Watchdog (UG0331, watchdog chapter). Enable, time-out and mode come from flash bits of the Libero design
 * (docs/fabric.md). Time-out and window are those; enable and mode (SYSREG's WDOG_CR) a program can write, and debug probes
 * switch it off.
 */
#ifndef DRIVERS_MSS_WATCHDOG_H
#define DRIVERS_MSS_WATCHDOG_H

#include "drivers/board.h"
#include "drivers/mss/sysreg.h"
#include "drivers/reg.h"

struct watchdog_regs {
    const volatile uint32_t WDOGVALUE;
    const volatile uint32_t WDOGLOAD;
    const volatile uint32_t WDOGMVRP;
    volatile uint32_t WDOGREFRESH;
    const volatile uint32_t WDOGENABLE;
    volatile uint32_t WDOGCONTROL;
    const volatile uint32_t WDOGSTATUS;
    volatile uint32_t WDOGRIS;
    const volatile uint32_t WDOGMIS;
};

REG_AT_OFFSET(struct watchdog_regs, WDOGVALUE, 0x00);
REG_AT_OFFSET(struct watchdog_regs, WDOGLOAD, 0x04);
REG_AT_OFFSET(struct watchdog_regs, WDOGMVRP, 0x08);
REG_AT_OFFSET(struct watchdog_regs, WDOGREFRESH, 0x0C);
REG_AT_OFFSET(struct watchdog_regs, WDOGENABLE, 0x10);
REG_AT_OFFSET(struct watchdog_regs, WDOGCONTROL, 0x14);
REG_AT_OFFSET(struct watchdog_regs, WDOGSTATUS, 0x18);
REG_AT_OFFSET(struct watchdog_regs, WDOGRIS, 0x1C);
REG_AT_OFFSET(struct watchdog_regs, WDOGMIS, 0x20);

#define WATCHDOG REG_BLOCK(struct watchdog_regs, 0x40005000u)

#define WATCHDOG_REFRESH_KEY 0xAC15DE42u
#define WATCHDOG_ENABLE_BIT  (1u << 0)
#define WATCHDOG_INTERRUPTS  (1u << 2) /* of WDOGCONTROL: time-out raises the NMI instead of a reset */

/*
 * Restarts the time-out. The board's design has no forbidden window, so any moment is right. The counter shows the new value
 * only some 64 watchdog clocks later. Context: any; belongs in one place, where the loop is known to be healthy.
 */
static inline void watchdog_refresh(void)
{
    WATCHDOG->WDOGREFRESH = WATCHDOG_REFRESH_KEY;
}

#define WATCHDOG_ON_LOOKS \
    32u /* of some cycles each: more than the 64 ticks after which the watchdog shows what was written */

/*
 * Switches the watchdog on where WDOG_CR is 0, as OpenOCD's script for this device leaves it until the next power-on. It counts
 * on from where it was stopped, so it is refreshed at once. A design may keep firmware from writing the register: then it stays
 * off. Context: start-up, slow loop.
 */
static inline void watchdog_switch_on(void)
{
    if (SYSREG->WDOG_CR != 0u) {
        return;
    }
    SYSREG->WDOG_CR = SYSREG_WDOG_ENABLE;
    watchdog_refresh();
    for (uint32_t n = 0; n < WATCHDOG_ON_LOOKS && (WATCHDOG->WDOGENABLE & WATCHDOG_ENABLE_BIT) == 0u; n++) {
    }
}

/* True if the watchdog is on, and resets the device: so a hung program ends. Context: any. */
static inline bool watchdog_resets(void)
{
    return (WATCHDOG->WDOGENABLE & WATCHDOG_ENABLE_BIT) != 0u && (WATCHDOG->WDOGCONTROL & WATCHDOG_INTERRUPTS) == 0u;
}

/* Time-out set in the design, in ticks of BOARD_WATCHDOG_HZ. Context: any. */
static inline uint32_t watchdog_timeout_ticks(void)
{
    return WATCHDOG->WDOGLOAD;
}

/* Ticks of BOARD_WATCHDOG_HZ left. Context: any. */
static inline uint32_t watchdog_remaining_ticks(void)
{
    return WATCHDOG->WDOGVALUE;
}

#endif
