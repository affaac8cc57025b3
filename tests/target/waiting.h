/* SPDX-License-Identifier: MIT */
/* Waiting by timer 2. waiting_begin() first. */
#ifndef TESTS_TARGET_WAITING_H
#define TESTS_TARGET_WAITING_H

#include "drivers/board.h"
#include "drivers/mss/timer.h"

#define US_TICKS (BOARD_MSS_TIMER_HZ / 1000000u)

static inline void waiting_begin(void)
{
    mss_timer2_start_free_running();
}

#endif
