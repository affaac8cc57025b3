/* SPDX-License-Identifier: MIT */
#include "drivers/mss/timer.h"

#include "drivers/cortex/nvic.h"
#include "drivers/mss/sysreg.h"

bool mss_timer1_start_periodic(uint32_t ticks)
{
    sysreg_release_reset(SYSREG_RESET_TIMER);
    mss_timer1_stop();
    if (ticks == 0u) {
        return false;
    }
    MSS_TIMER->TIM1_LOADVAL = ticks;
    /* One write to CTRL per start: a second one with the enable bit set may restart the count. */
    MSS_TIMER->TIM1_CTRL = MSS_TIMER_CTRL_ENABLE | MSS_TIMER_CTRL_INTEN;
    return true;
}

void mss_timer1_stop(void)
{
    MSS_TIMER->TIM1_CTRL = 0u;
    mss_timer1_acknowledge();
    nvic_clear_pending(MSS_IRQ_TIMER1);
}

void mss_timer2_start_once(uint32_t ticks)
{
    MSS_TIMER->TIM2_CTRL = 0u;
    mss_timer2_acknowledge();
    nvic_clear_pending(MSS_IRQ_TIMER2);
    MSS_TIMER->TIM2_LOADVAL = ticks;
    MSS_TIMER->TIM2_CTRL = MSS_TIMER_CTRL_ENABLE | MSS_TIMER_CTRL_ONE_SHOT | MSS_TIMER_CTRL_INTEN;
}

void mss_timer2_start_free_running(void)
{
    sysreg_release_reset(SYSREG_RESET_TIMER);
    MSS_TIMER->TIM2_CTRL = 0u;
    MSS_TIMER->TIM2_LOADVAL = UINT32_MAX;
    MSS_TIMER->TIM2_CTRL = MSS_TIMER_CTRL_ENABLE;
}
