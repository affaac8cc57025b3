/* SPDX-License-Identifier: MIT */
#include "firmware/system/boot.h"

#include <stddef.h>

#include "drivers/cortex/dwt.h"
#include "drivers/cortex/scb.h"
#include "drivers/mss/cache.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "firmware/axis/axis.h"
#include "firmware/monitor/device.h"
#include "startup/startup.h"

/* ==== the record of a processor fault ==== */

#define FAULT_MARK 0x50D1E5E5u
#define PROBE_MARK 0x9A0BE5E5u

/* Survives a reset: at a fixed address, and valid only with its mark and check sum. */
static struct {
    uint32_t probe; /* PROBE_MARK during a probe */
    uint32_t mark;
    struct postmortem record;
    uint32_t check; /* sum of the record's words */
} kept STARTUP_NOINIT;

static uint32_t postmortem_checksum(const struct postmortem *p)
{
    const uint32_t *const words = (const uint32_t *)(const void *)p;
    uint32_t sum = 0;
    for (size_t i = 0; i < sizeof *p / sizeof *words; i++) {
        sum += words[i];
    }
    return sum;
}

void postmortem_keep(const struct fault_frame *frame, uint32_t exc_return)
{
    static const struct fault_frame no_frame;

    kept.mark = FAULT_MARK;
    kept.record.valid = true;
    kept.record.exception = startup_exception_number();
    kept.record.frame_valid = frame != NULL;
    kept.record.frame = frame != NULL ? *frame : no_frame;
    kept.record.exc_return = exc_return;
    kept.record.cfsr = SCB->CFSR;
    kept.record.hfsr = SCB->HFSR;
    kept.record.mmfar = SCB->MMFAR;
    kept.record.bfar = SCB->BFAR;
    kept.record.edac = sysreg_edac_flags();
    kept.check = postmortem_checksum(&kept.record);
}

struct postmortem postmortem_collect(void)
{
    struct postmortem found = {.valid = false};
    if (kept.mark == FAULT_MARK && kept.check == postmortem_checksum(&kept.record)) {
        found = kept.record;
    }
    found.probe_failed = kept.probe == PROBE_MARK;
    kept.mark = 0;
    kept.probe = 0;
    return found;
}

void postmortem_probe(bool under_way)
{
    kept.probe = under_way ? PROBE_MARK : 0u;
    cpu_dsb();
}

/* ==== start-up ==== */

void boot_core(void)
{
    (void)cache_lock(link_code, link_array); /* otherwise the loop takes longer when other code has run */
    scb_enable_faults();
    (void)device_guard_stack(); /* device_fault() checks it */
    (void)dwt_init();           /* only 'status' needs the cycle counter */
    sysreg_release_reset(BOOT_BLOCKS);
    watchdog_refresh();
    watchdog_switch_on(); /* before the fabric, which may not respond */
}

/*
 * A fabric without a design may respond with a bus fault, or never. Either ends this run of the program; the next one finds the
 * mark, does not access the fabric, and reports it.
 */
static bool fabric_is_right(const struct fabric *fabric)
{
    postmortem_probe(true);
    const bool right = gate_id_ok(&fabric->gate) && (AXIS_COUNT == 1u || gate_axes(&fabric->gate) >= AXIS_COUNT);
    postmortem_probe(false);
    return right;
}

/* Power-on sets all cause bits. */
static enum fault fault_of_last_run(const struct postmortem *last)
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
    const enum fault past = fault_of_last_run(last);
    const enum fault present = device_fault();
    if (present == FAULT_CLOCK) {
        return present;
    }
    if (last->probe_failed || !fabric_is_right(fabric)) {
        return FAULT_FABRIC;
    }
    return present != FAULT_NONE ? present : past;
}
