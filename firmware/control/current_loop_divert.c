/* SPDX-License-Identifier: MIT */
/* Another entry in front of the current loop's handler, and away again. */
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
        cpu_dsb(); /* the next interrupt finds it */
    }
    cpu_irq_restore(mask);
}
