/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "gate.h"

#include <string.h>

enum { CONTROL = 0x00, STATUS = 0x04, ID = 0x08, CHOPPER = 0x0C, CHOPPER_ON = 0x10, CHOPPER_OFF = 0x14, AXES = 0x18 };
enum { WATCH_TIME = 0x1C, WATCH = 0x20, PROOF = 0x24 };
enum { ENABLE = 1u << 0, CHOPPING = 1u << 1 };
enum { LIVE = 1u << 0, ENCODER = 1u << 5, OVERRUN = 1u << 6, LIMIT = 1u << 7 };
enum { OVERCURRENT_NOW = 1u << 8, DRIVER_FAULT_NOW = 1u << 9, STO_A_NOW = 1u << 13, STO_B_NOW = 1u << 14 };

#define ID_VALUE       0x464F4332u
#define COUNT_SHIFT    4
#define IN_EN          (1u << 8)
#define THRESHOLD_BITS 0x7FFFu
#define WATCH_CLOCKS   0xFFFFFu
#define WATCH_STARTED  (1u << 31)
#define WATCH_THREAD   (1u << 8)
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
    watch_reset(&g->watch);
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
        return g->axis | (g->others + 1) << COUNT_SHIFT | (g->in_en ? IN_EN : 0u);
    case WATCH_TIME:
        return g->watch.clocks | (g->watch.started ? WATCH_STARTED : 0u);
    case WATCH:
        return g->watch.number | (g->watch.thread ? WATCH_THREAD : 0u);
    default:
        return 0;
    }
}

static void write_enable(struct gate *g, bool enable, sim_ps now)
{
    bool was_live = g->enabled;
    g->enabled = enable && (g->latches | active_causes(g)) == 0;
    watch_arm(&g->watch, g->enabled, was_live, now);
}

static void miss_proof(struct gate *g)
{
    latch(g, g->watch.thread ? GATE_THREAD_LOST : GATE_SLOW_LOST);
    watch_disarm(&g->watch);
}

void gate_write(struct gate *g, uint32_t offset, uint32_t value, sim_ps now)
{
    switch (offset) {
    case CONTROL:
        write_enable(g, value & ENABLE, now);
        break;
    case STATUS:
        g->latches &= ~value | active_causes(g);
        break;
    case WATCH_TIME:
        watch_start(&g->watch, value & WATCH_CLOCKS);
        break;
    case PROOF:
        if (watch_prove(&g->watch, value, now)) {
            miss_proof(g);
        }
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

void gate_committed(struct gate *g)
{
    g->watch.answered = true;
}

void gate_valley(struct gate *g)
{
    if (g->enabled && watch_valley(&g->watch)) {
        latch(g, GATE_LOOP_LOST);
    }
}

void gate_watch_late(struct gate *g)
{
    miss_proof(g);
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
