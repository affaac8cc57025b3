/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "adc.h"

#include <string.h>

enum { CONTROL = 0x00, STATUS = 0x04, RESULTS = 0x08, LAST_RESULT = 0x14, SEQUENCE = 0x18 };
enum { ENABLE = 1u << 0, IRQ_ENABLE = 1u << 1 };
enum { EOC = 1u << 0, OVERRUN = 1u << 1 };

void adc_reset(struct adc *a)
{
    memset(a, 0, sizeof *a);
    a->done_at = SIM_NEVER;
}

uint32_t adc_read(const struct adc *a, uint32_t offset)
{
    switch (offset) {
    case CONTROL:
        return a->control;
    case STATUS:
        return a->status;
    case SEQUENCE:
        return a->sequence;
    default:
        return offset >= RESULTS && offset <= LAST_RESULT ? a->result[(offset - RESULTS) / 4] : 0;
    }
}

void adc_write(struct adc *a, uint32_t offset, uint32_t value)
{
    if (offset == CONTROL) {
        a->control = value & (ENABLE | IRQ_ENABLE);
    } else if (offset == STATUS) {
        a->status &= ~value;
    }
}

bool adc_listens(const struct adc *a)
{
    return (a->control & ENABLE) && a->done_at == SIM_NEVER;
}

void adc_start(struct adc *a, const uint32_t code[4], sim_ps done_at)
{
    memcpy(a->sampled, code, sizeof a->sampled);
    a->done_at = done_at;
}

bool adc_finish(struct adc *a)
{
    bool overrun = a->status & EOC;
    memcpy(a->result, a->sampled, sizeof a->result);
    a->done_at = SIM_NEVER;
    a->sequence++;
    a->status |= overrun ? EOC | OVERRUN : EOC;
    return overrun;
}

bool adc_interrupt(const struct adc *a)
{
    return (a->status & EOC) && (a->control & IRQ_ENABLE);
}
