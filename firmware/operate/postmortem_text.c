/* SPDX-License-Identifier: MIT */
#include "firmware/operate/postmortem_text.h"

#include <stddef.h>

#include "firmware/operate/text.h"
#include "firmware/system/postmortem.h"

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
    const struct postmortem *const p = postmortem_record();
    if (p == NULL) {
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
