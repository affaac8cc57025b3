/* SPDX-License-Identifier: MIT */
#include "firmware/postmortem.h"

#include <stddef.h>
#include <stdint.h>

#include "drivers/cortex/scb.h"
#include "drivers/fabric/gate.h"
#include "firmware/text.h"
#include "startup/startup.h"

#define MARK 0x50D1E5E5u

struct postmortem {
    uint32_t mark;
    uint32_t exception; /* number: 2 NMI, 3 hard fault, 4 memory, 5 bus, 6 usage, 16 + n interrupt n */
    uint32_t frame_valid;
    struct fault_frame frame;
    uint32_t exc_return;
    uint32_t cfsr, hfsr, mmfar, bfar;
    uint32_t check; /* sum of all words before it */
};

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

    gate_disable();
    kept.mark = MARK;
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
    const bool valid = kept.mark == MARK && kept.check == checksum(&kept);
    if (valid) {
        collected = kept;
    }
    kept.mark = 0;
    return valid;
}

static const char *exception_name(uint32_t number)
{
    static const char *const names[] = {"thread",       "reset",     "NMI",        "hard fault",
                                        "memory fault", "bus fault", "usage fault"};
    return number < sizeof names / sizeof names[0] ? names[number] : "unexpected interrupt";
}

static void put_register(const char *name, uint32_t value)
{
    text_put(name);
    text_put_hex(value);
}

static void put_frame(const struct fault_frame *f)
{
    put_register("  pc ", f->pc);
    put_register(" lr ", f->lr);
    put_register(" xpsr ", f->xpsr);
    text_put_line("");
    put_register("  r0 ", f->r0);
    put_register(" r1 ", f->r1);
    put_register(" r2 ", f->r2);
    put_register(" r3 ", f->r3);
    put_register(" r12 ", f->r12);
    text_put_line("");
}

void postmortem_print(void)
{
    const struct postmortem *const p = &collected;
    if (p->mark != MARK) {
        return;
    }
    text_put("processor exception before the last reset: ");
    text_put(exception_name(p->exception));
    text_put(" (");
    text_put_int((int32_t)p->exception);
    text_put_line(")");
    if (p->frame_valid != 0u) {
        put_frame(&p->frame);
    } else {
        text_put_line("  no frame: the stack was not usable");
    }
    put_register("  cfsr ", p->cfsr);
    put_register(" hfsr ", p->hfsr);
    put_register(" mmfar ", p->mmfar);
    put_register(" bfar ", p->bfar);
    put_register(" exc_return ", p->exc_return);
    text_put_line("");
}
