/* SPDX-License-Identifier: MIT */
#include "firmware/control/bridge.h"

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/fabric.h"

/* Test and store are masked against all interrupts. */
bool bridge_enable(const volatile struct current_loop *c, struct fabric *f)
{
    const uint32_t mask = cpu_irq_save();
    const bool may = c->locked_out == 0u;
    if (may) {
        (void)gate_enable(&f->gate);
    }
    cpu_irq_restore(mask);
    return may;
}
