/* SPDX-License-Identifier: MIT */
/* Puts another entry before the current loop's handler, and removes it. */
#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "firmware/control/current_loop.h"

void current_loop_divert(volatile struct current_loop *c, void (*entry)(void), void (**handler)(void))
{
    const uint32_t mask = cpu_irq_save(); /* the slow loop may select another one */
    if (c->diverted == NULL) {
        *handler = *c->handlers->vector;
        c->diverted = handler;
        *c->handlers->vector = entry;
    }
    cpu_irq_restore(mask);
}

void current_loop_undivert(volatile struct current_loop *c)
{
    const uint32_t mask = cpu_irq_save();
    if (c->diverted != NULL) {
        *c->handlers->vector = *c->diverted;
        c->diverted = NULL;
        cpu_dsb(); /* visible to the next interrupt */
    }
    cpu_irq_restore(mask);
}
