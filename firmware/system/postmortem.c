/* SPDX-License-Identifier: MIT */
#include "firmware/system/postmortem.h"

#include <stddef.h>
#include <stdint.h>

#include "drivers/cortex/scb.h"
#include "drivers/fabric/fabric.h"
#include "startup/startup.h"

static struct postmortem kept STARTUP_NOINIT;
static struct postmortem collected;

static uint32_t checksum(const struct postmortem *p)
{
    const uint32_t *const words = (const uint32_t *)(const void *)p;
    uint32_t sum = 0;
    for (size_t i = 0; i < offsetof(struct postmortem, check) / sizeof *words; i++) {
        sum += words[i];
    }
    return sum;
}

/*
 * The entry of every processor fault and of interrupts that nobody expects: bridge off before anything else, then the
 * record, then a reset, because nothing that ran can be trusted any more.
 */
void fault_taken(const struct fault_frame *frame, uint32_t exc_return)
{
    static const struct fault_frame no_frame;

    gate_disable(&FABRIC0->gate);
    kept.mark = POSTMORTEM_MARK;
    kept.exception = startup_exception_number();
    kept.frame_valid = frame != NULL;
    kept.frame = frame != NULL ? *frame : no_frame;
    kept.exc_return = exc_return;
    kept.cfsr = SCB->CFSR;
    kept.hfsr = SCB->HFSR;
    kept.mmfar = SCB->MMFAR;
    kept.bfar = SCB->BFAR;
    kept.check = checksum(&kept);
    scb_system_reset();
}

bool postmortem_collect(void)
{
    const bool valid = kept.mark == POSTMORTEM_MARK && kept.check == checksum(&kept);
    if (valid) {
        collected = kept;
    }
    kept.mark = 0;
    return valid;
}

const struct postmortem *postmortem_record(void)
{
    return collected.mark == POSTMORTEM_MARK ? &collected : NULL;
}
