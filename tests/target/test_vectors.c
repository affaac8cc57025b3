/* SPDX-License-Identifier: MIT */
/*
 * Every external interrupt reaches the handler of its own name: raised by software, one after the other. That names and
 * numbers are the user guide's: tests/silicon/test_silicon.py.
 * (QEMU's model of the NVIC ends at 80 on this machine; the table holds 82.)
 */
#include "drivers/cortex/nvic.h"
#include "drivers/cortex/scb.h"
#include "startup/startup.h"
#include "tests/target/harness.h"

#define TESTED_INTERRUPTS 81u

static volatile uint32_t calls[STARTUP_EXTERNAL_VECTORS];
static volatile uint32_t exception[STARTUP_EXTERNAL_VECTORS];

#define COUNTING_HANDLER(number, handler) \
    void handler(void) \
    { \
        calls[number]++; \
        exception[number] = startup_exception_number(); \
    }
STARTUP_EXTERNAL_HANDLERS(COUNTING_HANDLER)

static volatile uint32_t pendsv_calls, svc_calls;

void PendSV_Handler(void)
{
    pendsv_calls++;
}

void SVC_Handler(void)
{
    svc_calls++;
}

static void forget_calls(void)
{
    for (uint32_t irq = 0; irq < STARTUP_EXTERNAL_VECTORS; irq++) {
        calls[irq] = 0u;
        exception[irq] = 0u;
    }
}

/* Interrupts other than `irq` that ran, plus `irq` itself if it did not run exactly once as exception 16 + irq. */
static uint32_t wrong_calls(uint32_t irq)
{
    uint32_t wrong = 0;
    for (uint32_t other = 0; other < STARTUP_EXTERNAL_VECTORS; other++) {
        if (calls[other] != (other == irq ? 1u : 0u)) {
            wrong++;
        }
    }
    return wrong + (exception[irq] == 16u + irq ? 0u : 1u);
}

int main(void)
{
    (void)harness_begin();
    uint32_t wrong = 0;
    uint32_t ran_disabled = 0;
    for (uint32_t irq = 0; irq < TESTED_INTERRUPTS; irq++) {
        forget_calls();
        nvic_pend(irq);
        ran_disabled += calls[irq];
        nvic_enable(irq);
        cpu_isb();
        wrong += wrong_calls(irq);
        nvic_disable(irq);
    }
    harness_equal("vectors: each of 81 interrupts reaches its own handler, once", wrong, 0u);
    harness_equal("vectors: none runs while disabled", ran_disabled, 0u);

    __asm volatile("svc #0" : : : "memory");
    harness_equal("vectors: SVC", svc_calls, 1u);
    harness_equal("vectors: PendSV not raised yet", pendsv_calls, 0u);
    scb_pend_pendsv();
    cpu_dsb();
    cpu_isb();
    harness_equal("vectors: PendSV", pendsv_calls, 1u);

    harness_end();
}
