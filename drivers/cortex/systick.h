/* SPDX-License-Identifier: MIT */
/*
 * SysTick: a 24-bit down counter at the core's clock. ARMv7-M ARM, B3.3. The drive does not need it (its loops run on
 * the end of conversion and on MSS timer 1); it is here for short measurements and for users' own ticks.
 */
#ifndef DRIVERS_CORTEX_SYSTICK_H
#define DRIVERS_CORTEX_SYSTICK_H

#include "drivers/reg.h"

struct systick_regs {
    volatile uint32_t CSR;
    volatile uint32_t RVR;
    volatile uint32_t CVR;
    volatile uint32_t CALIB;
};

REG_AT_OFFSET(struct systick_regs, CSR, 0x00);
REG_AT_OFFSET(struct systick_regs, RVR, 0x04);
REG_AT_OFFSET(struct systick_regs, CVR, 0x08);
REG_AT_OFFSET(struct systick_regs, CALIB, 0x0C);

#define SYSTICK REG_BLOCK(struct systick_regs, 0xE000E010u)

#define SYSTICK_CSR_ENABLE         (1u << 0)
#define SYSTICK_CSR_TICKINT        (1u << 1)
#define SYSTICK_CSR_CLKSOURCE_CORE (1u << 2)
#define SYSTICK_MAX_TICKS          0x1000000u

/*
 * Starts SysTick_Handler every `ticks` core clocks, 2...2^24. Returns false and leaves it stopped outside that range.
 * Context: thread.
 */
static inline bool systick_start_periodic(uint32_t ticks)
{
    SYSTICK->CSR = 0u;
    if (ticks < 2u || ticks > SYSTICK_MAX_TICKS) {
        return false;
    }
    SYSTICK->RVR = ticks - 1u;
    SYSTICK->CVR = 0u; /* any write clears; the reload follows */
    SYSTICK->CSR = SYSTICK_CSR_CLKSOURCE_CORE | SYSTICK_CSR_TICKINT | SYSTICK_CSR_ENABLE;
    return true;
}

/* Context: any. */
static inline void systick_stop(void)
{
    SYSTICK->CSR = 0u;
}

/* Core clocks until the next tick, counting down. Context: any. */
static inline uint32_t systick_remaining_ticks(void)
{
    return SYSTICK->CVR;
}

#endif
