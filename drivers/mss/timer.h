/* SPDX-License-Identifier: MIT */
/*
 * MSS timer: two 32-bit down counters on APB0's clock (UG0331, system timer chapter). Timer 1 gives a periodic
 * interrupt, timer 2 a time base that never stops, or a single delayed interrupt. The block's 64-bit mode is not used.
 */
#ifndef DRIVERS_MSS_TIMER_H
#define DRIVERS_MSS_TIMER_H

#include "drivers/board.h"
#include "drivers/reg.h"

struct mss_timer_regs {
    const volatile uint32_t TIM1_VAL;
    volatile uint32_t TIM1_LOADVAL;
    volatile uint32_t TIM1_BGLOADVAL;
    volatile uint32_t TIM1_CTRL;
    volatile uint32_t TIM1_RIS;
    const volatile uint32_t TIM1_MIS;
    const volatile uint32_t TIM2_VAL;
    volatile uint32_t TIM2_LOADVAL;
    volatile uint32_t TIM2_BGLOADVAL;
    volatile uint32_t TIM2_CTRL;
    volatile uint32_t TIM2_RIS;
    const volatile uint32_t TIM2_MIS;
    uint32_t reserved_30[9]; /* the 64-bit mode's */
    volatile uint32_t TIM64_MODE;
};

REG_AT_OFFSET(struct mss_timer_regs, TIM1_VAL, 0x00);
REG_AT_OFFSET(struct mss_timer_regs, TIM1_LOADVAL, 0x04);
REG_AT_OFFSET(struct mss_timer_regs, TIM1_BGLOADVAL, 0x08);
REG_AT_OFFSET(struct mss_timer_regs, TIM1_CTRL, 0x0C);
REG_AT_OFFSET(struct mss_timer_regs, TIM1_RIS, 0x10);
REG_AT_OFFSET(struct mss_timer_regs, TIM1_MIS, 0x14);
REG_AT_OFFSET(struct mss_timer_regs, TIM2_VAL, 0x18);
REG_AT_OFFSET(struct mss_timer_regs, TIM2_LOADVAL, 0x1C);
REG_AT_OFFSET(struct mss_timer_regs, TIM2_BGLOADVAL, 0x20);
REG_AT_OFFSET(struct mss_timer_regs, TIM2_CTRL, 0x24);
REG_AT_OFFSET(struct mss_timer_regs, TIM2_RIS, 0x28);
REG_AT_OFFSET(struct mss_timer_regs, TIM2_MIS, 0x2C);
REG_AT_OFFSET(struct mss_timer_regs, TIM64_MODE, 0x54);

#define MSS_TIMER REG_BLOCK(struct mss_timer_regs, 0x40004000u)

#define MSS_TIMER_CTRL_ENABLE   (1u << 0)
#define MSS_TIMER_CTRL_ONE_SHOT (1u << 1)
#define MSS_TIMER_CTRL_INTEN    (1u << 2)

/*
 * Interrupt MSS_IRQ_TIMER1 every `ticks` of BOARD_MSS_TIMER_HZ, from a whole period after the call. Releases the
 * block's reset and forgets an interrupt left pending; the caller enables the interrupt in the NVIC at the priority it
 * wants. Whether the silicon's period is ticks or ticks + 1 is not documented: do not build a clock on it.
 *
 * Returns false, with the timer stopped, for ticks 0. Context: thread.
 */
bool mss_timer1_start_periodic(uint32_t ticks);

/* No more interrupts from timer 1, none pending. Context: any. */
void mss_timer1_stop(void);

/*
 * Clears timer 1's interrupt; first thing in its handler. Reads back so the line has dropped when the handler returns.
 * Context: Timer1_IRQHandler.
 */
static inline void mss_timer1_acknowledge(void)
{
    MSS_TIMER->TIM1_RIS = 1u;
    (void)MSS_TIMER->TIM1_RIS;
}

/* Ticks until timer 1's next interrupt, counting down. Context: any. */
static inline uint32_t mss_timer1_remaining_ticks(void)
{
    return MSS_TIMER->TIM1_VAL;
}

/*
 * Interrupt MSS_IRQ_TIMER2 once, `ticks` of BOARD_MSS_TIMER_HZ from now; replaces an earlier start. The caller enables the
 * interrupt in the NVIC. Range: 1 and up. Context: any, one user.
 */
void mss_timer2_start_once(uint32_t ticks);

/* Clears timer 2's interrupt, and the line has dropped when it returns. Context: Timer2_IRQHandler. */
static inline void mss_timer2_acknowledge(void)
{
    MSS_TIMER->TIM2_RIS = 1u;
    (void)MSS_TIMER->TIM2_RIS;
}

/* Starts timer 2 as a time base, from 0, without interrupt. Context: thread. */
void mss_timer2_start_free_running(void);

/*
 * Ticks of BOARD_MSS_TIMER_HZ since the start of timer 2, counting up modulo 2^32 (43 s at 100 MHz; one tick may be
 * missing at each wrap). Differences of two readings as uint32_t hold across the wrap. Context: any.
 */
static inline uint32_t mss_timer2_now(void)
{
    return UINT32_MAX - MSS_TIMER->TIM2_VAL;
}

#endif
