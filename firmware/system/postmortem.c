/* SPDX-License-Identifier: MIT */
#include "firmware/system/postmortem.h"

#include <stddef.h>

#include "drivers/cortex/scb.h"
#include "drivers/mss/sysreg.h"

#define FAULT_MARK 0x50D1E5E5u
#define PROBE_MARK 0x9A0BE5E5u

/* Lives through a reset, so its place is fixed, and nothing in it is trusted without its mark and sum. */
static struct {
    uint32_t probe; /* PROBE_MARK while one is under way */
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
    found.probe_died = kept.probe == PROBE_MARK;
    kept.mark = 0;
    kept.probe = 0;
    return found;
}

void postmortem_probe(bool under_way)
{
    kept.probe = under_way ? PROBE_MARK : 0u;
    cpu_dsb();
}
