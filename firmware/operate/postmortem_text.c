/* SPDX-License-Identifier: MIT */
#include "firmware/operate/postmortem_text.h"

static const char *exception_name(uint32_t number)
{
    static const char *const names[] = {"thread",       "reset",     "NMI",        "hard fault",
                                        "memory fault", "bus fault", "usage fault"};
    switch (number) {
    case POSTMORTEM_MSS_PLL:
        return "the MSS PLL lost its lock";
    case POSTMORTEM_FABRIC_PLL:
        return "the fabric's PLL lost its lock";
    case POSTMORTEM_ECC:
        return "a memory error that cannot be corrected";
    default:
        return number < sizeof names / sizeof names[0] ? names[number] : "unexpected interrupt";
    }
}

static void put_register(struct text *t, const char *name, uint32_t value)
{
    text_put(t, name);
    text_put_hex(t, value);
}

static void put_frame(struct text *t, const struct fault_frame *f)
{
    put_register(t, "  pc ", f->pc);
    put_register(t, " lr ", f->lr);
    put_register(t, " xpsr ", f->xpsr);
    text_put_line(t, "");
    put_register(t, "  r0 ", f->r0);
    put_register(t, " r1 ", f->r1);
    put_register(t, " r2 ", f->r2);
    put_register(t, " r3 ", f->r3);
    put_register(t, " r12 ", f->r12);
    text_put_line(t, "");
}

void postmortem_print(struct text *t, const struct postmortem *p)
{
    if (!p->valid) {
        return;
    }
    text_put(t, "processor exception before the last reset: ");
    text_put(t, exception_name(p->exception));
    text_put(t, " (");
    text_put_int(t, (int32_t)p->exception);
    text_put_line(t, ")");
    if (p->frame_valid != 0u) {
        put_frame(t, &p->frame);
    } else {
        text_put_line(t, "  no frame: the stack was not usable");
    }
    put_register(t, "  cfsr ", p->cfsr);
    put_register(t, " hfsr ", p->hfsr);
    put_register(t, " mmfar ", p->mmfar);
    put_register(t, " bfar ", p->bfar);
    put_register(t, " exc_return ", p->exc_return);
    put_register(t, " edac ", p->edac);
    text_put_line(t, "");
}
