/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "gate.h"

#include <string.h>

enum { CONTROL = 0x00, STATUS = 0x04, ID = 0x08, CHOPPER = 0x0C, CHOPPER_ON = 0x10, CHOPPER_OFF = 0x14, AXES = 0x18 };
enum { ENABLE = 1u << 0, CHOPPING = 1u << 1 };
enum { LIVE = 1u << 0, ENCODER = 1u << 5, OVERRUN = 1u << 6, LIMIT = 1u << 7 };
enum { OVERCURRENT_NOW = 1u << 8, DRIVER_FAULT_NOW = 1u << 9, STO_A_NOW = 1u << 13, STO_B_NOW = 1u << 14 };

#define ID_VALUE       0x464F4330u
#define ONE_AXIS       0x10u /* the first, of one */
#define THRESHOLD_BITS 0x7FFFu
#define ALL_SIX        0x3Fu
#define HIGH_SIDES     0x15u

static void latch(struct gate *g, uint32_t which)
{
    g->latches |= which;
    g->enabled = false;
}

/* Latches of which the cause is still present. */
static uint32_t active_causes(const struct gate *g)
{
    return g->asking | (g->both_sides ? GATE_INTERLOCK : 0u);
}

void gate_reset(struct gate *g)
{
    g->enabled = false;
    g->both_sides = false;
    g->latches = g->asking; /* the pins come from the power stage and do not notice a reset */
    chopper_reset(&g->chopper);
}

static uint32_t status(const struct gate *g)
{
    return (g->enabled ? LIVE : 0u) | g->latches | (g->encoder_faulty ? ENCODER : 0u) |
           (g->adc_overran ? OVERRUN : 0u) | (g->adc_beyond_limit ? LIMIT : 0u) |
           (g->asking & GATE_OVERCURRENT ? OVERCURRENT_NOW : 0u) |
           (g->asking & GATE_DRIVER_FAULT ? DRIVER_FAULT_NOW : 0u) | (g->asking & GATE_STO_A ? STO_A_NOW : 0u) |
           (g->asking & GATE_STO_B ? STO_B_NOW : 0u);
}

uint32_t gate_read(const struct gate *g, uint32_t offset)
{
    switch (offset) {
    case CONTROL:
        return g->enabled ? ENABLE : 0;
    case STATUS:
        return status(g);
    case ID:
        return ID_VALUE ^ g->id_xor;
    case CHOPPER:
        return (g->chopper.enabled ? ENABLE : 0u) | (gate_chops(g) ? CHOPPING : 0u);
    case CHOPPER_ON:
        return g->chopper.on_above;
    case CHOPPER_OFF:
        return g->chopper.off_at;
    case AXES:
        return ONE_AXIS;
    default:
        return 0;
    }
}

void gate_write(struct gate *g, uint32_t offset, uint32_t value)
{
    switch (offset) {
    case CONTROL:
        g->enabled = (value & ENABLE) && (g->latches | active_causes(g)) == 0;
        break;
    case STATUS:
        g->latches &= ~value | active_causes(g);
        break;
    case CHOPPER:
        chopper_enable(&g->chopper, value & ENABLE);
        break;
    case CHOPPER_ON:
        g->chopper.on_above = value & THRESHOLD_BITS;
        break;
    case CHOPPER_OFF:
        g->chopper.off_at = value & THRESHOLD_BITS;
        break;
    default:
        break;
    }
}

unsigned gate_follow(struct gate *g, unsigned commands)
{
    commands &= ALL_SIX;
    g->both_sides = (commands & HIGH_SIDES & (commands >> 1)) != 0;
    if (g->both_sides) {
        latch(g, GATE_INTERLOCK);
    }
    return g->enabled ? commands : 0;
}

void gate_pin(struct gate *g, enum gate_latch which, bool stops)
{
    g->asking = stops ? g->asking | which : g->asking & ~(uint32_t)which;
    if (stops) {
        latch(g, which);
    }
}

void gate_adc_overrun(struct gate *g)
{
    if (g->enabled) {
        latch(g, GATE_LOOP_LOST);
    }
}

void gate_mirror(struct gate *g, bool encoder_faulty, bool adc_overran, bool adc_beyond_limit)
{
    g->encoder_faulty = encoder_faulty;
    g->adc_overran = adc_overran;
    g->adc_beyond_limit = adc_beyond_limit;
}

bool gate_live(const struct gate *g)
{
    return g->enabled;
}

bool gate_chops(const struct gate *g)
{
    return g->chopper.enabled && g->chopper.on && !(g->asking & GATE_CLOCK_LOST);
}
