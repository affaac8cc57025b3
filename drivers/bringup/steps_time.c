/* SPDX-License-Identifier: MIT */
/* Clocks against each other: B05, B10 and B12. */
#include "drivers/bringup/bringup.h"
#include "drivers/cortex/cpu.h"
#include "drivers/cortex/dwt.h"
#include "drivers/cortex/nvic.h"
#include "drivers/mss/timer.h"
#include "drivers/mss/watchdog.h"

#define CYCLES_PER_WATCHDOG_TICK (BOARD_M3_HZ / BOARD_WATCHDOG_HZ)
#define MEASURED_CYCLES          1000000u
#define PATIENCE_CYCLES          10000u
#define PERIOD_TICKS             1000u
#define PERIODS                  1000u
#define SLEEP_TICKS              100000u

void wait_until(uint32_t start, uint32_t ticks)
{
    while (mss_timer2_now() - start < ticks) {
        /* time passes */
    }
}

static void wait_cycles(uint32_t start, uint32_t cycles)
{
    while (dwt_cycles() - start < cycles) {
        /* time passes */
    }
}

static uint32_t refresh_ticks(void)
{
    const uint32_t before = watchdog_remaining_ticks(), start = dwt_cycles();
    watchdog_refresh();
    while (watchdog_remaining_ticks() <= before && dwt_cycles() - start < PATIENCE_CYCLES) {
        /* it shows, or never does */
    }
    return (dwt_cycles() - start) / CYCLES_PER_WATCHDOG_TICK;
}

void step_watchdog(struct bringup *b)
{
    report(b, powered_on(b) ? FACT_WDOG_CR : FACT_WDOG_CR_WARM, SYSREG->WDOG_CR);
    watchdog_switch_on(); /* it ends the accesses to come that the fabric leaves without an answer */
    report(b, FACT_WDOGLOAD, SYSREG->WDOGLOAD);
    report(b, FACT_WDOGMVRP, SYSREG->WDOGMVRP);
    report(b, FACT_WDOGSTATUS, WATCHDOG->WDOGSTATUS);
    report(b, FACT_REFRESH, refresh_ticks());
    const uint32_t before = watchdog_remaining_ticks(), start = dwt_cycles();
    wait_cycles(start, MEASURED_CYCLES);
    report(b, FACT_WATCHDOG_RATE, before - watchdog_remaining_ticks());
}

/* The flag rises at the end of each period; polls go with it. */
static void wait_for_period(uint32_t start)
{
    while (MSS_TIMER->TIM1_RIS == 0u && dwt_cycles() - start < 4u * PERIODS * PERIOD_TICKS) {
        /* time passes */
    }
    mss_timer1_acknowledge();
}

static uint32_t period_cycles(void)
{
    const uint32_t begin = dwt_cycles();
    (void)mss_timer1_start_periodic(PERIOD_TICKS);
    wait_for_period(begin);
    const uint32_t start = dwt_cycles();
    for (uint32_t n = 0; n < PERIODS; n++) {
        wait_for_period(begin);
    }
    return (dwt_cycles() - start + PERIODS / 2u) / PERIODS;
}

/* Whether half a period is forgotten. */
static uint32_t timer_restarts(void)
{
    (void)mss_timer1_start_periodic(SLEEP_TICKS);
    wait_until(mss_timer2_now(), SLEEP_TICKS / 2u);
    MSS_TIMER->TIM1_CTRL = MSS_TIMER_CTRL_ENABLE | MSS_TIMER_CTRL_INTEN;
    return mss_timer1_remaining_ticks() > SLEEP_TICKS * 3u / 4u ? 1u : 0u;
}

void step_timer(struct bringup *b)
{
    report(b, FACT_TIMER_PERIOD, period_cycles());
    report(b, FACT_TIMER_RESTARTS, timer_restarts());
    mss_timer1_stop();
    report(b, FACT_TIM64_MODE, MSS_TIMER->TIM64_MODE);
}

/* Cycles that DWT counts meanwhile. */
static uint32_t sleep(uint32_t ticks)
{
    nvic_enable(MSS_IRQ_TIMER1);
    const uint32_t start = dwt_cycles();
    (void)mss_timer1_start_periodic(ticks);
    cpu_wait_for_interrupt();
    const uint32_t cycles = dwt_cycles() - start;
    mss_timer1_stop();
    nvic_disable(MSS_IRQ_TIMER1);
    return cycles;
}

void step_sleep(struct bringup *b)
{
    const uint32_t start = dwt_cycles(), start_ticks = mss_timer2_now();
    wait_cycles(start, MEASURED_CYCLES);
    report(b, FACT_AWAKE, mss_timer2_now() - start_ticks);
    report(b, FACT_ASLEEP, sleep(SLEEP_TICKS));
}

void ten_seconds(void)
{
    report_text("B19", "0 s");
    (void)sleep(10u * BOARD_MSS_TIMER_HZ);
    report_text("B19", "10 s by this device's clock");
}
