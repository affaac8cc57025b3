/* SPDX-License-Identifier: MIT */
#include "firmware/slow_loop.h"

#include "drivers/cortex/nvic.h"
#include "drivers/mss/timer.h"
#include "firmware/config.h"
#include "firmware/drive.h"
#include "startup/startup.h"

void Timer1_IRQHandler(void)
{
    mss_timer1_acknowledge();
    drive_step();
}

void slow_loop_start(void)
{
    nvic_priority(BOARD_IRQ_TICK, CONFIG_PRIORITY_SLOW_LOOP);
    nvic_enable(BOARD_IRQ_TICK);
    mss_timer1_start_periodic(BOARD_MSS_TIMER_HZ / CONFIG_SLOW_HZ);
}
