/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "adc.h"

#include <string.h>

enum { CONTROL = 0x00, STATUS = 0x04, RESULTS = 0x08, LAST_RESULT = 0x14, SEQUENCE = 0x18 };
enum {
    TEMP = 0x38,
    VALID = 0x3C,
    GAINS = 0x40,
    LAST_GAIN = 0x48,
    SETTLE = 0x4C,
    MODULATOR = 0x50,
    MODULATOR_TRIP = 0x54
};
enum { OFFSETS = 0x1C, LAST_OFFSET = 0x24, OFFSET_BITS = 0xFFFF, OFFSET_AFTER_RESET = 16 * 2048 };
enum { LIMITS = 0x28, LAST_LIMIT = 0x34, LIMIT_BITS = 0x1FFFF };
enum { I_TRIP, SUM_TRIP, V_MIN, V_MAX };
enum { CURRENT_Q15_PER_CODE = 16, BUS_Q15_PER_CODE = 8, LARGEST_Q15 = 32767 };
enum { ENABLE = 1u << 0, IRQ_ENABLE = 1u << 1, RECONSTRUCT = 1u << 2, MODULATORS = 1u << 3 };
enum { ALL_PHASES = 7, SETTLE_BITS = 0xFFF, MODULATOR_BITS = 0x1F33, MODULATOR_AFTER_RESET = 0x0511, GAIN_SHIFT = 11 };
enum { EOC = 1u << 0, OVERRUN = 1u << 1 };
enum { CURRENT = 1u << 4, SUM = 1u << 5, VBUS_HIGH = 1u << 6, VBUS_LOW = 1u << 7 };

#define CONTROL_BITS (ENABLE | IRQ_ENABLE | RECONSTRUCT | MODULATORS)
#define BEYOND_LIMIT (CURRENT | SUM | VBUS_HIGH | VBUS_LOW)

void adc_reset(struct adc *a)
{
    memset(a, 0, sizeof *a);
    a->done_at = SIM_NEVER;
    for (int k = 0; k < 3; k++) {
        a->offset[k] = OFFSET_AFTER_RESET;
    }
    a->limit[I_TRIP] = a->limit[SUM_TRIP] = a->limit[V_MAX] = a->modulator_trip = LIMIT_BITS;
    a->modulator = MODULATOR_AFTER_RESET;
}

static bool is_offset(uint32_t offset)
{
    return offset >= OFFSETS && offset <= LAST_OFFSET;
}

static bool is_gain(uint32_t offset)
{
    return offset >= GAINS && offset <= LAST_GAIN;
}

static bool is_limit(uint32_t offset)
{
    return offset >= LIMITS && offset <= LAST_LIMIT;
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
    case TEMP:
        return a->temperature;
    case VALID:
        return a->valid;
    case SETTLE:
        return a->settle;
    case MODULATOR:
        return a->modulator;
    case MODULATOR_TRIP:
        return a->modulator_trip;
    default:
        if (is_gain(offset)) {
            return a->gain[(offset - GAINS) / 4];
        }
        if (is_offset(offset)) {
            return a->offset[(offset - OFFSETS) / 4];
        }
        if (is_limit(offset)) {
            return a->limit[(offset - LIMITS) / 4];
        }
        return offset >= RESULTS && offset <= LAST_RESULT ? a->result[(offset - RESULTS) / 4] : 0;
    }
}

void adc_write(struct adc *a, uint32_t offset, uint32_t value)
{
    if (offset == CONTROL) {
        a->control = value & CONTROL_BITS;
        if (!(a->control & ENABLE)) { /* what is under way is dropped */
            a->done_at = SIM_NEVER;
        }
    } else if (offset == SETTLE) {
        a->settle = value & SETTLE_BITS;
    } else if (offset == MODULATOR) {
        a->modulator = value & MODULATOR_BITS;
    } else if (offset == MODULATOR_TRIP) {
        a->modulator_trip = value & LIMIT_BITS;
    } else if (is_gain(offset)) {
        a->gain[(offset - GAINS) / 4] = value & 0xFF;
    } else if (offset == STATUS) {
        a->status &= ~(value & (EOC | OVERRUN));
    } else if (is_offset(offset)) {
        a->offset[(offset - OFFSETS) / 4] = value & OFFSET_BITS;
    } else if (is_limit(offset)) {
        a->limit[(offset - LIMITS) / 4] = value & LIMIT_BITS;
    }
}

bool adc_listens(const struct adc *a)
{
    return (a->control & ENABLE) && a->done_at == SIM_NEVER;
}

void adc_see_gates(struct adc *a, unsigned gates, sim_ps at)
{
    for (int k = 0; k < 3; k++) {
        unsigned phase = 1u << k;
        bool low = gates & (2u << (2 * k));
        if (low && !(a->low_sides & phase)) {
            a->low_since[k] = at;
        } else if (!low && (a->low_sides & phase)) {
            a->low_until[k] = at;
        }
        a->low_sides = low ? a->low_sides | phase : a->low_sides & ~phase;
    }
}

/* Phases whose low side has been on for long enough up to now, even if it goes off in this instant. */
static uint32_t settled(const struct adc *a, sim_ps now)
{
    uint32_t phases = 0;
    for (int k = 0; k < 3; k++) {
        bool conducted = a->low_sides & (1u << k) || a->low_until[k] == now;
        sim_ps clocks = conducted ? (now - a->low_since[k]) / SIM_PS_PER_FABRIC_CLOCK : 0;
        phases |= clocks >= a->settle ? 1u << k : 0u;
    }
    return phases;
}

void adc_start(struct adc *a, const uint32_t code[4], sim_ps now, sim_ps done_at)
{
    a->valid_sampled = settled(a, now);
    memcpy(a->sampled, code, sizeof a->sampled);
    a->done_at = done_at;
}

void adc_sample(struct adc *a, int channel, uint32_t code)
{
    a->sampled[channel] = code;
}

void adc_sense(struct adc *a, uint32_t code)
{
    a->sensed = code;
}

static uint32_t clamped(int32_t value)
{
    return (uint32_t)(value < -LARGEST_Q15 ? -LARGEST_Q15 : (value > LARGEST_Q15 ? LARGEST_Q15 : value));
}

/* No modulators are fitted to this board: their lines are at 0, and so are their codes. */
static uint32_t current_q15(const struct adc *a, int k)
{
    int32_t code = a->control & MODULATORS ? 0 : CURRENT_Q15_PER_CODE * (int32_t)a->sampled[k];
    int32_t less_offset = code - (int32_t)a->offset[k], gain = (int8_t)a->gain[k];
    return clamped(less_offset + ((less_offset * gain + (1 << (GAIN_SHIFT - 1))) >> GAIN_SHIFT));
}

/* The one phase that is not valid becomes minus the sum of the others. */
static void reconstruct(struct adc *a)
{
    for (int k = 0; k < 3; k++) {
        if (a->valid_sampled == (ALL_PHASES & ~(1u << k))) {
            a->result[k] = clamped(-(int32_t)(a->result[(k + 1) % 3] + a->result[(k + 2) % 3]));
        }
    }
}

static int32_t magnitude(uint32_t q15)
{
    int32_t value = (int32_t)q15;
    return value < 0 ? -value : value;
}

/* The flags of the newest results. A sum that is off once may be a disturbance. */
static void compare(struct adc *a)
{
    bool sum_off = magnitude(a->result[0] + a->result[1] + a->result[2]) > (int32_t)a->limit[SUM_TRIP];
    a->status &= ~(uint32_t)BEYOND_LIMIT;
    for (int k = 0; k < 3; k++) {
        a->status |= magnitude(a->result[k]) > (int32_t)a->limit[I_TRIP] ? CURRENT : 0u;
    }
    a->status |= sum_off && a->sum_was_off ? SUM : 0u;
    a->status |= a->result[3] > a->limit[V_MAX] ? VBUS_HIGH : 0u;
    a->status |= a->result[3] < a->limit[V_MIN] ? VBUS_LOW : 0u;
    a->sum_was_off = sum_off;
}

bool adc_finish(struct adc *a)
{
    bool overrun = a->status & EOC;
    for (int k = 0; k < 3; k++) {
        a->result[k] = current_q15(a, k);
    }
    if (a->control & RECONSTRUCT) {
        reconstruct(a);
    }
    a->valid = a->valid_sampled;
    a->result[3] = BUS_Q15_PER_CODE * a->sampled[3];
    a->temperature = a->sensed;
    compare(a);
    a->done_at = SIM_NEVER;
    a->sequence++;
    a->status |= overrun ? EOC | OVERRUN : EOC;
    return overrun;
}

bool adc_overran(const struct adc *a)
{
    return a->status & OVERRUN;
}

bool adc_beyond_limit(const struct adc *a)
{
    return a->status & BEYOND_LIMIT;
}

uint32_t adc_vbus(const struct adc *a)
{
    return a->result[3];
}

bool adc_interrupt(const struct adc *a)
{
    return (a->status & EOC) && (a->control & IRQ_ENABLE);
}
