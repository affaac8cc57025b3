/* SPDX-License-Identifier: MIT */
/* What answers in the fabric, and how its reset is wired: B13. */
#include "drivers/bringup/bringup.h"
#include "drivers/bringup/measure.h"
#include "drivers/cortex/cpu.h"
#include "drivers/fabric/fabric.h"
#include "startup/startup.h"

#define NO_MEMORY 0x20020000u /* above eSRAM, with SECDED or without */
#define AXES_MOST 3u          /* in the window's place of the fourth nobody is */

/* 0 as well where there is no answer. */
static uint32_t identity(uint32_t axis)
{
    uint32_t id = 0;
    return measure_probe(&FABRIC(axis)->gate.ID, &id) ? id : 0u;
}

bool fabric_is_ours(void)
{
    return identity(0u) == GATE_ID;
}

void step_fabric(struct bringup *b)
{
    uint32_t value;
    report(b, FACT_GATE_IDENTITY, identity(0u));
    report(b, FACT_NO_AXIS, identity(AXES_MOST));
    report(b, FACT_UNMAPPED, measure_probe(REG_BLOCK(const volatile uint32_t, NO_MEMORY), &value) ? 0u : 1u);
    SYSREG->SOFT_RESET_CR |= SYSREG_RESET_FABRIC; /* which CoreResetP does not heed */
    cpu_dsb();
    const uint32_t held = identity(0u), held_no_axis = identity(AXES_MOST);
    sysreg_release_reset(SYSREG_RESET_FABRIC);
    report(b, FACT_HELD_IDENTITY, held);
    report(b, FACT_HELD_NO_AXIS, held_no_axis);
}
