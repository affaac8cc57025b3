/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "gate.h"

#include <string.h>

enum { CONTROL = 0x00, STATUS = 0x04, ID = 0x08 };
enum { ENABLE = 1u << 0 };
enum { LIVE = 1u << 0, ENCODER = 1u << 5, OVERRUN = 1u << 6, LIMIT = 1u << 7 };
enum { OVERCURRENT_NOW = 1u << 8, DRIVER_FAULT_NOW = 1u << 9 };

#define ID_VALUE   0x464F4321u
#define ALL_SIX    0x3Fu
#define HIGH_SIDES 0x15u

static void latch(struct gate *g, uint32_t which)
{
    g->latches |= which;
    g->enabled = false;
}

/* Latches of which the cause is still present. */
static uint32_t active_causes(const struct gate *g)
{
    return (g->overcurrent ? GATE_OVERCURRENT : 0u) | (g->driver_fault ? GATE_DRIVER_FAULT : 0u) |
           (g->both_sides ? GATE_INTERLOCK : 0u);
}

void gate_reset(struct gate *g)
{
    g->enabled = false;
    g->both_sides = false;
    g->latches = active_causes(g); /* the inputs come from the power stage and do not notice a reset */
}

static uint32_t status(const struct gate *g)
{
    return (g->enabled ? LIVE : 0u) | g->latches | (g->encoder_faulty ? ENCODER : 0u) |
           (g->adc_overran ? OVERRUN : 0u) | (g->adc_beyond_limit ? LIMIT : 0u) |
           (g->overcurrent ? OVERCURRENT_NOW : 0u) | (g->driver_fault ? DRIVER_FAULT_NOW : 0u);
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
    default:
        return 0;
    }
}

void gate_write(struct gate *g, uint32_t offset, uint32_t value)
{
    if (offset == CONTROL) {
        g->enabled = (value & ENABLE) && g->latches == 0;
    } else if (offset == STATUS) {
        g->latches &= ~value | active_causes(g);
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

void gate_set_overcurrent(struct gate *g, bool active)
{
    g->overcurrent = active;
    if (active) {
        latch(g, GATE_OVERCURRENT);
    }
}

void gate_set_driver_fault(struct gate *g, bool active)
{
    g->driver_fault = active;
    if (active) {
        latch(g, GATE_DRIVER_FAULT);
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
