/* SPDX-License-Identifier: MIT */
/* The core's blocks: priorities of interrupts, PendSV, cycle counter, SysTick. */
#include "drivers/cortex/cpu.h"
#include "drivers/cortex/dwt.h"
#include "drivers/cortex/nvic.h"
#include "drivers/cortex/scb.h"
#include "drivers/cortex/systick.h"
#include "startup/startup.h"
#include "tests/target/harness.h"
#include "tests/target/waiting.h"

static volatile uint32_t order[8], order_count, pendsv_calls, systick_calls;

static void note(uint32_t who)
{
    order[order_count % 8u] = who;
    order_count++;
}

/* Pends a more urgent one (GPIO1) and an equal one (GPIO2) while it runs. */
void GPIO0_IRQHandler(void)
{
    note(0x10u);
    nvic_pend(MSS_IRQ_GPIO(1u));
    nvic_pend(MSS_IRQ_GPIO(2u));
    note(nvic_is_active(MSS_IRQ_GPIO(0u)) && nvic_is_pending(MSS_IRQ_GPIO(2u)) ? 0x11u : 0xEEu);
}

void GPIO1_IRQHandler(void)
{
    note(0x20u);
}

void GPIO2_IRQHandler(void)
{
    note(0x30u);
}

void PendSV_Handler(void)
{
    pendsv_calls++;
}

void SysTick_Handler(void)
{
    systick_calls++;
}

static void test_priorities(void)
{
    nvic_priority(MSS_IRQ_GPIO(3u), 99u);
    harness_equal("nvic: priority is held to 15", NVIC->IPR[MSS_IRQ_GPIO(3u)], 0xF0u);
    nvic_priority(MSS_IRQ_GPIO(0u), 5u);
    nvic_priority(MSS_IRQ_GPIO(1u), 4u);
    nvic_priority(MSS_IRQ_GPIO(2u), 5u);
    harness_equal("nvic: priority in the upper nibble", NVIC->IPR[MSS_IRQ_GPIO(0u)], 0x50u);
    nvic_enable(MSS_IRQ_COUNT);
    harness_true("nvic: a number too large is no interrupt", !nvic_is_enabled(MSS_IRQ_COUNT));

    nvic_enable(MSS_IRQ_GPIO(0u));
    nvic_enable(MSS_IRQ_GPIO(1u));
    nvic_enable(MSS_IRQ_GPIO(2u));
    harness_true("nvic: enabled", nvic_is_enabled(MSS_IRQ_GPIO(1u)));

    const uint32_t primask = cpu_irq_save();
    nvic_pend(MSS_IRQ_GPIO(0u));
    harness_equal("nvic: held back by PRIMASK", order_count, 0u);
    harness_true("nvic: but pending", nvic_is_pending(MSS_IRQ_GPIO(0u)));
    nvic_clear_pending(MSS_IRQ_GPIO(0u));
    cpu_irq_restore(primask);
    cpu_isb();
    harness_equal("nvic: and forgotten", order_count, 0u);

    const uint32_t before = cpu_mask_below(5u);
    nvic_pend(MSS_IRQ_GPIO(2u));
    nvic_pend(MSS_IRQ_GPIO(1u));
    const uint32_t masked_count = order_count;
    const uint32_t masked_first = order[0];
    (void)cpu_mask_below(before);
    cpu_isb();
    harness_equal("nvic: the mask lets one through", masked_count, 1u);
    harness_equal("nvic: the more urgent one", masked_first, 0x20u);
    harness_equal("nvic: the other follows", order[1], 0x30u);

    order_count = 0u;
    nvic_pend(MSS_IRQ_GPIO(0u));
    harness_equal("nvic: four steps", order_count, 4u);
    harness_equal("nvic: first the one pended", order[0], 0x10u);
    harness_equal("nvic: preempted by the more urgent", order[1], 0x20u);
    harness_equal("nvic: not by the equal", order[2], 0x11u);
    harness_equal("nvic: which comes after it", order[3], 0x30u);
    nvic_disable(MSS_IRQ_GPIO(0u));
    nvic_pend(MSS_IRQ_GPIO(0u));
    harness_equal("nvic: disabled, it does not run", order_count, 4u);
    nvic_clear_pending(MSS_IRQ_GPIO(0u));
}

static void test_core(void)
{
    scb_priority(SCB_EXCEPTION_PENDSV, 15u);
    harness_equal("scb: PendSV priority", SCB->SHPR[10], 0xF0u);
    scb_pend_pendsv();
    cpu_dsb();
    cpu_isb();
    harness_equal("scb: PendSV comes", pendsv_calls, 1u);

    harness_true("dwt: has a cycle counter", dwt_init());
    const uint32_t first = dwt_cycles();
    for (volatile uint32_t i = 0; i < 100u; i++) {
        /* let it count */
    }
    harness_between("dwt: counts up", dwt_cycles() - first, 300u, 5000u);

    harness_true("systick: refuses 1", !systick_start_periodic(1u));
    harness_true("systick: refuses more than 24 bits", !systick_start_periodic(SYSTICK_MAX_TICKS + 1u));
    harness_true("systick: starts", systick_start_periodic(10000u));
    const uint32_t start = mss_timer2_now();
    while (systick_calls < 3u && mss_timer2_now() - start < 1000u * US_TICKS) {
        /* bounded */
    }
    systick_stop();
    harness_equal("systick: ticks", systick_calls, 3u);
}

int main(void)
{
    (void)harness_begin();
    waiting_begin();
    test_priorities();
    test_core();
    harness_end();
}
