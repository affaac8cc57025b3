/* SPDX-License-Identifier: MIT */
/* The two MSS timers against their registers. */
#include "drivers/cortex/nvic.h"
#include "drivers/mss/timer.h"
#include "startup/startup.h"
#include "tests/target/harness.h"
#include "tests/target/waiting.h"

#define PERIOD_TICKS 20000u
#define PERIODS      8u

static volatile uint32_t timer1_calls, timer1_first, timer1_last, timer1_ris_after;

void Timer1_IRQHandler(void)
{
    const uint32_t now = mss_timer2_now();
    mss_timer1_acknowledge();
    timer1_ris_after |= MSS_TIMER->TIM1_RIS | MSS_TIMER->TIM1_MIS;
    if (timer1_calls == 0u) {
        timer1_first = now;
    }
    timer1_last = now;
    timer1_calls++;
}

static void test_timer(void)
{
    mss_timer2_start_free_running();
    const uint32_t t0 = mss_timer2_now();
    harness_between("timer: timer 2 starts at 0", t0, 0u, 1000u);
    for (volatile uint32_t i = 0; i < 1000u; i++) {
        /* let it count */
    }
    harness_between("timer: timer 2 counts up", mss_timer2_now() - t0, 1000u, 1000000u);

    harness_true("timer: refuses a period of 0", !mss_timer1_start_periodic(0u));
    harness_equal("timer: and stays off", MSS_TIMER->TIM1_CTRL & MSS_TIMER_CTRL_ENABLE, 0u);

    nvic_enable(MSS_IRQ_TIMER1);
    const uint32_t start = mss_timer2_now();
    harness_true("timer: starts", mss_timer1_start_periodic(PERIOD_TICKS));
    while (timer1_calls < PERIODS && mss_timer2_now() - start < 2u * PERIODS * PERIOD_TICKS) {
        /* bounded */
    }
    mss_timer1_stop();
    harness_equal("timer: interrupts", timer1_calls, PERIODS);
    harness_between("timer: first comes a period after the start", timer1_first - start, PERIOD_TICKS,
                    PERIOD_TICKS + 2000u);
    harness_between("timer: period", timer1_last - timer1_first, (PERIODS - 1u) * PERIOD_TICKS - 20u,
                    (PERIODS - 1u) * (PERIOD_TICKS + 1u) + 20u);
    harness_equal("timer: acknowledged", timer1_ris_after, 0u);

    const uint32_t calls = timer1_calls;
    wait_us(3u * PERIOD_TICKS / US_TICKS);
    harness_equal("timer: no interrupt after the stop", timer1_calls - calls, 0u);
    nvic_disable(MSS_IRQ_TIMER1);
}

int main(void)
{
    (void)harness_begin();
    test_timer();
    harness_end();
}
