/* SPDX-License-Identifier: MIT */
#include "firmware/system/boot.h"

#include "drivers/cortex/dwt.h"
#include "drivers/cortex/scb.h"
#include "drivers/mss/cache.h"
#include "drivers/mss/watchdog.h"
#include "firmware/axis/axis.h"
#include "firmware/monitor/device.h"
#include "startup/startup.h"

void boot_core(void)
{
    (void)cache_lock(link_code, link_array); /* without it the loop takes longer when other code has run */
    scb_enable_faults();
    (void)device_guard_stack(); /* device_fault() looks whether it is there */
    (void)dwt_init();           /* without a cycle counter 'status' shows no cycles, and that is all */
    sysreg_release_reset(BOOT_BLOCKS);
    watchdog_refresh();
    watchdog_switch_on(); /* before the fabric, which may not answer */
}

/*
 * A fabric without a design may answer with a bus fault, or never. Either ends this life of the program; the next one finds
 * the mark, leaves the fabric alone, and can say so.
 */
static bool fabric_answers(const struct fabric *fabric)
{
    postmortem_probe(true);
    const bool right = gate_id_ok(&fabric->gate) && (AXIS_COUNT == 1u || gate_axes(&fabric->gate) >= AXIS_COUNT);
    postmortem_probe(false);
    return right;
}

/* Power-on sets the bit of every cause, whatever happened before. */
static enum fault fault_of_last_life(const struct postmortem *last)
{
    if ((last->reset_causes & SYSREG_CAUSE_POWER_ON) != 0u) {
        return FAULT_NONE;
    }
    if ((last->reset_causes & SYSREG_CAUSE_LOCKUP) != 0u) {
        return FAULT_LOCKUP;
    }
    if (last->valid && last->exception == POSTMORTEM_ECC) {
        return FAULT_ECC;
    }
    if (last->valid && (last->exception == POSTMORTEM_MSS_PLL || last->exception == POSTMORTEM_FABRIC_PLL)) {
        return FAULT_PLL;
    }
    if (last->valid) {
        return FAULT_EXCEPTION;
    }
    return (last->reset_causes & SYSREG_CAUSE_WATCHDOG) != 0u ? FAULT_WATCHDOG : FAULT_NONE;
}

enum fault boot_check(const struct fabric *fabric, struct postmortem *last)
{
    *last = postmortem_collect();
    last->reset_causes = sysreg_reset_cause();
    const enum fault past = fault_of_last_life(last);
    const enum fault present = device_fault();
    if (present == FAULT_CLOCK) {
        return present;
    }
    if (last->probe_died || !fabric_answers(fabric)) {
        return FAULT_FABRIC;
    }
    return present != FAULT_NONE ? present : past;
}
