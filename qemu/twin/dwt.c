/* SPDX-License-Identifier: GPL-2.0-or-later */
/* ARMv7-M Architecture Reference Manual, C1.8. No comparators: they read 0. TRCENA is not looked at. */
#include "dwt.h"

enum { CTRL = 0x00, CYCCNT = 0x04 };
enum { CYCCNTENA = 1u << 0 };

#define CTRL_AFTER_RESET 0x40000000u /* NUMCOMP 4, as in Cortex-M3 r2p1 */

void dwt_init(struct dwt *d, uint64_t (*elapsed)(void))
{
    d->elapsed = elapsed;
    d->count = 0;
    dwt_reset(d);
}

static uint32_t cycles(const struct dwt *d)
{
    return d->control & CYCCNTENA ? d->count + (uint32_t)(d->elapsed() - d->since) : d->count;
}

static void set_cycles(struct dwt *d, uint32_t value)
{
    d->count = value;
    d->since = d->elapsed();
}

void dwt_reset(struct dwt *d)
{
    d->control = CTRL_AFTER_RESET;
    set_cycles(d, 0);
}

uint32_t dwt_read(void *dwt, uint32_t offset)
{
    const struct dwt *d = dwt;
    switch (offset) {
    case CTRL:
        return d->control;
    case CYCCNT:
        return cycles(d);
    default:
        return 0;
    }
}

void dwt_write(void *dwt, uint32_t offset, uint32_t value)
{
    struct dwt *d = dwt;
    if (offset == CTRL) {
        set_cycles(d, cycles(d));
        d->control = CTRL_AFTER_RESET | (value & CYCCNTENA);
    } else if (offset == CYCCNT) {
        set_cycles(d, value);
    }
}
