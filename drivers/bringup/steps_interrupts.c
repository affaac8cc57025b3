/* SPDX-License-Identifier: MIT */
/* Each interrupt that the drive uses, raised by software and by itself: B11. */
#include "drivers/bringup/bringup.h"
#include "drivers/cortex/nvic.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/timer.h"
#include "startup/startup.h"

#define WINDOW_TICKS (BOARD_MSS_TIMER_HZ / 100u)
#define HALF_COUNTS  (BOARD_FABRIC_HZ / 40000u) /* of 20 kHz */
#define DEAD_COUNTS  100u

volatile uint32_t interrupts_came[MSS_IRQ_COUNT];

/* Drops the line where there is one: otherwise it would come again at once. */
static void come(void)
{
    const uint32_t number = startup_exception_number() - STARTUP_SYSTEM_VECTORS;
    interrupts_came[number]++;
    if (number == BOARD_IRQ_ADC && fabric_is_ours()) {
        (void)adc_acknowledge(&FABRIC0->adc);
    }
    if (number == BOARD_IRQ_TICK) {
        mss_timer1_acknowledge();
    }
}

void I2C1_SMBAlert_IRQHandler(void) __attribute__((alias("come")));
void I2C1_SMBus_IRQHandler(void) __attribute__((alias("come")));
void UART0_IRQHandler(void) __attribute__((alias("come")));
void UART1_IRQHandler(void) __attribute__((alias("come")));
void Timer1_IRQHandler(void) __attribute__((alias("come")));
void Timer2_IRQHandler(void) __attribute__((alias("come")));
void FabricIrq0_IRQHandler(void) __attribute__((alias("come")));

static bool comes_once(uint32_t irq)
{
    interrupts_came[irq] = 0u;
    nvic_clear_pending(irq);
    nvic_enable(irq);
    nvic_pend(irq);
    wait_until(mss_timer2_now(), 1000u);
    nvic_disable(irq);
    return interrupts_came[irq] == 1u;
}

static uint32_t raised(void)
{
    static const uint32_t used[] = {BOARD_IRQ_SCOPE,   BOARD_IRQ_CONSOLE, BOARD_IRQ_BUS,     BOARD_IRQ_TICK,
                                    BOARD_IRQ_RELEASE, BOARD_IRQ_ADC,     BOARD_IRQ_PUT_BACK};
    uint32_t count = 0;
    for (uint32_t n = 0; n < sizeof used / sizeof used[0]; n++) {
        count += comes_once(used[n]) ? 1u : 0u;
    }
    return count;
}

/* The carrier runs, the gates stay off. */
static uint32_t adc_rate(void)
{
    const struct pwm_setup setup = {HALF_COUNTS, DEAD_COUNTS, DEAD_COUNTS, PWM_UPDATE_VALLEY, 0u};
    if (!fabric_is_ours() || !pwm_init(&FABRIC0->pwm, &setup)) {
        return 0u;
    }
    adc_start(&FABRIC0->adc);
    interrupts_came[BOARD_IRQ_ADC] = 0u;
    nvic_clear_pending(BOARD_IRQ_ADC);
    nvic_enable(BOARD_IRQ_ADC);
    wait_until(mss_timer2_now(), WINDOW_TICKS);
    nvic_disable(BOARD_IRQ_ADC);
    adc_stop(&FABRIC0->adc);
    FABRIC0->pwm.CONTROL = 0u;
    return interrupts_came[BOARD_IRQ_ADC];
}

/* Those that only software raises. */
static uint32_t by_themselves(void)
{
    interrupts_came[BOARD_IRQ_SCOPE] = 0u;
    interrupts_came[BOARD_IRQ_PUT_BACK] = 0u;
    nvic_enable(BOARD_IRQ_SCOPE);
    nvic_enable(BOARD_IRQ_PUT_BACK);
    wait_until(mss_timer2_now(), WINDOW_TICKS);
    nvic_disable(BOARD_IRQ_SCOPE);
    nvic_disable(BOARD_IRQ_PUT_BACK);
    return interrupts_came[BOARD_IRQ_SCOPE] + interrupts_came[BOARD_IRQ_PUT_BACK];
}

void step_interrupts(struct bringup *b)
{
    MMUART0->IER = 0u;
    report(b, FACT_INTERRUPTS, raised());
    report(b, FACT_QUIET, by_themselves());
    report(b, FACT_PWM_RATE, adc_rate());
}
