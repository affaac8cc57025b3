/* SPDX-License-Identifier: MIT */
/*
 * Data watchpoint and trace unit: only its cycle counter. ARMv7-M ARM, C1.8; DEMCR C1.6.5.
 */
#ifndef DRIVERS_CORTEX_DWT_H
#define DRIVERS_CORTEX_DWT_H

#include "drivers/reg.h"

struct dwt_regs {
    volatile uint32_t CTRL;
    volatile uint32_t CYCCNT;
};

REG_AT_OFFSET(struct dwt_regs, CTRL, 0x00);
REG_AT_OFFSET(struct dwt_regs, CYCCNT, 0x04);

#define DWT   REG_BLOCK(struct dwt_regs, 0xE0001000u)
#define DEMCR (*REG_BLOCK(volatile uint32_t, 0xE000EDFCu))

#define DEMCR_TRCENA       (1u << 24)
#define DWT_CTRL_CYCCNTENA (1u << 0)
#define DWT_CTRL_NOCYCCNT  (1u << 25)

/*
 * Starts the cycle counter at 0. Returns false if the core was built without one; dwt_cycles() is then constant.
 * Context: thread, once.
 */
static inline bool dwt_init(void)
{
    DEMCR |= DEMCR_TRCENA; /* without it the unit's registers do not answer */
    DWT->CYCCNT = 0u;
    DWT->CTRL |= DWT_CTRL_CYCCNTENA;
    return (DWT->CTRL & DWT_CTRL_NOCYCCNT) == 0u;
}

/* Core cycles since dwt_init(), modulo 2^32 (43 s at 100 MHz). It stands still while the core sleeps. Context: any. */
static inline uint32_t dwt_cycles(void)
{
    return DWT->CYCCNT;
}

#endif
