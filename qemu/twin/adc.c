/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "adc.h"

#include <string.h>

enum { CONTROL = 0x00, STATUS = 0x04, RESULTS = 0x08, LAST_RESULT = 0x14, SEQUENCE = 0x18 };
enum { OFFSETS = 0x1C, LAST_OFFSET = 0x24, LIMITS = 0x28, LAST_LIMIT = 0x34 };
enum { ENABLE = 1u << 0, IRQ_ENABLE = 1u << 1 };
enum { EOC = 1u << 0, OVERRUN = 1u << 1 };
enum { CURRENT = 1u << 4, SUM = 1u << 5, VBUS_HIGH = 1u << 6, VBUS_LOW = 1u << 7 };
enum { I_TRIP, SUM_TRIP, V_MIN, V_MAX };

#define BEYOND         (CURRENT | SUM | VBUS_HIGH | VBUS_LOW)
#define OFFSET_NOMINAL 0x8000u
#define OFFSET_MASK    0x1FFFFu
#define LIMIT_MASK     0x1FFFFu

void adc_reset(struct adc *a)
{
    memset(a, 0, sizeof *a);
    a->done_at = SIM_NEVER;
    for (int k = 0; k < 3; k++) {
        a->offset[k] = OFFSET_NOMINAL;
    }
    a->limit[I_TRIP] = a->limit[SUM_TRIP] = a->limit[V_MAX] = LIMIT_MASK;
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
        break;
    }
    if (offset >= RESULTS && offset <= LAST_RESULT) {
        return a->result[(offset - RESULTS) / 4];
    }
    if (offset >= OFFSETS && offset <= LAST_OFFSET) {
        return a->offset[(offset - OFFSETS) / 4];
    }
    return offset >= LIMITS && offset <= LAST_LIMIT ? a->limit[(offset - LIMITS) / 4] : 0;
}

void adc_write(struct adc *a, uint32_t offset, uint32_t value)
{
    if (offset == CONTROL) {
        a->control = value & (ENABLE | IRQ_ENABLE);
    } else if (offset == STATUS) {
        a->status &= ~(value & (EOC | OVERRUN));
    } else if (offset >= OFFSETS && offset <= LAST_OFFSET) {
        a->offset[(offset - OFFSETS) / 4] = value & OFFSET_MASK;
    } else if (offset >= LIMITS && offset <= LAST_LIMIT) {
        a->limit[(offset - LIMITS) / 4] = value & LIMIT_MASK;
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

static int32_t magnitude(int32_t x)
{
    return x < 0 ? -x : x;
}

static void compare(struct adc *a, const int32_t i[3], int32_t vbus)
{
    bool sum_off = magnitude(i[0] + i[1] + i[2]) > (int32_t)a->limit[SUM_TRIP];
    a->status &= ~(uint32_t)BEYOND;
    for (int k = 0; k < 3; k++) {
        a->status |= magnitude(i[k]) > (int32_t)a->limit[I_TRIP] ? CURRENT : 0u;
    }
    a->status |= sum_off && a->sum_was_off ? SUM : 0u;
    a->status |= vbus > (int32_t)a->limit[V_MAX] ? VBUS_HIGH : 0u;
    a->status |= vbus < (int32_t)a->limit[V_MIN] ? VBUS_LOW : 0u;
    a->sum_was_off = sum_off;
}

static void convert(struct adc *a)
{
    int32_t i[3], vbus = (int32_t)(8 * a->sampled[3]);
    for (int k = 0; k < 3; k++) {
        i[k] = (int32_t)(16 * a->sampled[k]) - (int32_t)a->offset[k];
        i[k] = i[k] < -32767 ? -32767 : i[k] > 32767 ? 32767 : i[k];
        a->result[k] = (uint32_t)i[k];
    }
    a->result[3] = (uint32_t)vbus;
    compare(a, i, vbus);
}

bool adc_finish(struct adc *a)
{
    bool overrun = a->status & EOC;
    convert(a);
    a->done_at = SIM_NEVER;
    a->sequence++;
    a->status |= overrun ? EOC | OVERRUN : EOC;
    return overrun;
}

bool adc_interrupt(const struct adc *a)
{
    return (a->status & EOC) && (a->control & IRQ_ENABLE);
}

bool adc_has_overrun(const struct adc *a)
{
    return a->status & OVERRUN;
}

bool adc_beyond_limit(const struct adc *a)
{
    return a->status & BEYOND;
}
