/* SPDX-License-Identifier: MIT */
#include "firmware/system/handlers.h"

#include "drivers/cortex/nvic.h"
#include "drivers/mss/timer.h"
#include "firmware/settings/config.h"
#include "firmware/system/axes.h"
#include "startup/startup.h"

struct axis axes[AXIS_COUNT];
struct thermal_memory axes_heat[AXIS_COUNT] STARTUP_NOINIT;

void current_loop_fault(void)
{
    axis_sample_fault(&axes[0]);
}

void Timer1_IRQHandler(void)
{
    mss_timer1_acknowledge();
    axis_step(&axes[0]);
}

void handlers_start_current_loop(void)
{
    nvic_clear_pending(BOARD_IRQ_ADC);
    nvic_priority(BOARD_IRQ_ADC, CONFIG_PRIORITY_CURRENT_LOOP);
    nvic_enable(BOARD_IRQ_ADC);
}

void handlers_start_slow_loop(void)
{
    nvic_priority(BOARD_IRQ_TICK, CONFIG_PRIORITY_SLOW_LOOP);
    nvic_enable(BOARD_IRQ_TICK);
    mss_timer1_start_periodic(BOARD_MSS_TIMER_HZ / CONFIG_SLOW_HZ);
}
