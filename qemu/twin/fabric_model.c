/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Events at the same time are taken in the order of the signal path: PWM, end of a conversion, chopper. */
#include "fabric_model.h"

#include <math.h>
#include <string.h>

#define SLOT_BYTES   0x100u
#define STO_TEST     100000   /* clocks: 1 ms */
#define STO_PATIENCE 50000000 /* 500 ms */

enum { SLOT_PWM, SLOT_ADC, SLOT_ENCODER, SLOT_GATE, SLOTS };

static struct fabric_model *model(struct fabric *f)
{
    return (struct fabric_model *)f;
}

static const struct fabric_model *looked_at(const struct fabric *f)
{
    return (const struct fabric_model *)f;
}

static uint32_t fabric_clock(double t_ps)
{
    return (uint32_t)(int64_t)floor(t_ps / SIM_PS_PER_FABRIC_CLOCK);
}

static void show_wires(struct fabric_model *m)
{
    m->fabric.live = gate_live(&m->gate);
    m->fabric.chops = gate_chops(&m->gate);
    m->fabric.interrupt = adc_interrupt(&m->adc);
    m->fabric.valley_at = m->pwm.valley_at;
}

/* Drivers with an input and an enable make the dead time themselves; the ADC goes by the fabric's all the same. */
static void drive_gates(struct fabric_model *m, sim_ps at)
{
    pwm_catch_up(&m->pwm, at);
    pwm_set_live(&m->pwm, gate_live(&m->gate));
    unsigned gates = gate_follow(&m->gate, m->pwm.outputs);
    m->gates = m->pwm.outputs;
    m->led = m->pwm.led;
    m->fabric.gates = m->gate.in_en && gate_live(&m->gate) ? m->pwm.led : gates;
    adc_see_gates(&m->adc, gates, at);
    show_wires(m);
}

/* What the inputs of safe torque off ask for, to the gates. */
static void show_sto(struct fabric_model *m)
{
    unsigned asks = sto_asks(&m->sto);
    gate_pin(&m->gate, GATE_STO_A, asks & STO_ASKS_A);
    gate_pin(&m->gate, GATE_STO_B, asks & STO_ASKS_B);
    gate_pin(&m->gate, GATE_STO_APART, asks & STO_ASKS_APART);
}

static sim_ps sto_due_at(const struct fabric_model *m)
{
    int64_t clock = sto_due(&m->sto);
    return clock == INT64_MAX ? SIM_NEVER : clock * SIM_PS_PER_FABRIC_CLOCK;
}

static void reset(struct fabric *f, sim_ps now)
{
    struct fabric_model *m = model(f);
    sto_reset(&m->sto, now / SIM_PS_PER_FABRIC_CLOCK);
    show_sto(m);
    pwm_reset(&m->pwm, now);
    adc_reset(&m->adc);
    encoder_reset(&m->encoder, m->encoder.edges);
    gate_reset(&m->gate);
    drive_gates(m, now);
}

/* ---- events ---- */

static sim_ps earlier(sim_ps a, sim_ps b)
{
    return a < b ? a : b;
}

static sim_ps next_event(struct fabric *f)
{
    const struct fabric_model *m = looked_at(f);
    sim_ps beside_pwm = earlier(m->adc.done_at, m->gate.chopper.old_at), late_at = m->gate.watch.late_at;
    return earlier(earlier(pwm_next_event(&m->pwm), sto_due_at(m)), earlier(beside_pwm, late_at));
}

/* Of an edge the physics notices nothing until a switch follows it. */
static bool needs_physics(struct fabric *f)
{
    const struct fabric_model *m = looked_at(f);
    return next_event(f) != pwm_next_event(&m->pwm) || pwm_triggers_next(&m->pwm);
}

static unsigned take_pwm_event(struct fabric_model *m, sim_ps at)
{
    bool triggers = pwm_take_event(&m->pwm);
    m->fabric.valley_at = m->pwm.valley_at;
    bool was_live = gate_live(&m->gate);
    if (m->pwm.at_valley) {
        gate_valley(&m->gate);
    }
    if (triggers || m->pwm.outputs != m->gates || m->pwm.led != m->led || was_live != gate_live(&m->gate)) {
        drive_gates(m, at);
    }
    if (triggers) {
        encoder_latch(&m->encoder, fabric_clock((double)at));
    }
    return triggers ? FABRIC_TRIGGERED : 0;
}

/* An overrun cuts the gates when the results are there. */
static unsigned end_conversion(struct fabric_model *m)
{
    sim_ps at = m->adc.done_at;
    if (adc_finish(&m->adc)) {
        gate_adc_overrun(&m->gate);
        drive_gates(m, at);
    }
    chopper_sample(&m->gate.chopper, adc_vbus(&m->adc), at);
    show_wires(m);
    return FABRIC_CONVERTED;
}

static unsigned take_event(struct fabric *f)
{
    struct fabric_model *m = model(f);
    sim_ps at = next_event(f);
    if (at == pwm_next_event(&m->pwm)) {
        return take_pwm_event(m, at);
    }
    if (at == m->adc.done_at) {
        return end_conversion(m);
    }
    if (at == sto_due_at(m)) {
        sto_take(&m->sto, at / SIM_PS_PER_FABRIC_CLOCK);
        show_sto(m);
        drive_gates(m, at);
        return 0;
    }
    if (at == m->gate.watch.late_at) {
        gate_watch_late(&m->gate);
        drive_gates(m, at);
        return 0;
    }
    chopper_grow_old(&m->gate.chopper);
    show_wires(m);
    return 0;
}

static void catch_up(struct fabric *f, sim_ps now)
{
    pwm_catch_up(&model(f)->pwm, now);
}

static sim_ps next_trigger(struct fabric *f)
{
    return pwm_next_trigger(&looked_at(f)->pwm);
}

static sim_ps next_conversion_end(struct fabric *f)
{
    const struct fabric_model *m = looked_at(f);
    if (m->adc.done_at != SIM_NEVER) {
        return m->adc.done_at;
    }
    sim_ps trigger_at = pwm_next_trigger(&m->pwm);
    return !adc_listens(&m->adc) || trigger_at == SIM_NEVER ? SIM_NEVER : trigger_at + m->conversion;
}

/* ---- converters ---- */

static bool listens(const struct fabric *f)
{
    return adc_listens(&looked_at(f)->adc);
}

static void convert(struct fabric *f, const uint32_t code[4], sim_ps now)
{
    struct fabric_model *m = model(f);
    adc_start(&m->adc, code, now, now + m->conversion);
}

static void sample(struct fabric *f, int channel, uint32_t code)
{
    adc_sample(&model(f)->adc, channel, code);
}

static bool converting(const struct fabric *f)
{
    return looked_at(f)->adc.done_at != SIM_NEVER;
}

static void sense(struct fabric *f, uint32_t code)
{
    adc_sense(&model(f)->adc, code);
}

/* ---- pins ---- */

static void stop(struct fabric *f, enum gate_latch which, bool stops, sim_ps now)
{
    struct fabric_model *m = model(f);
    if (which == GATE_STO_A || which == GATE_STO_B) {
        sto_pin(&m->sto, which == GATE_STO_B, stops, now / SIM_PS_PER_FABRIC_CLOCK);
    } else {
        gate_pin(&m->gate, which, stops);
    }
    drive_gates(m, now);
}

static void turn(struct fabric *f, const struct shaft_way *way, const struct index_pulse *pulse)
{
    struct encoder *e = &model(f)->encoder;
    e->edges = way->edges - way->moved;
    encoder_follow(e, way->edges, pulse);
    encoder_miscount(e, way->miscounted);
    encoder_time_edge(e, fabric_clock(way->last_edge_ps));
}

static void show_hall(struct fabric *f, unsigned state, double changed_ps)
{
    encoder_show_hall(&model(f)->encoder, state, fabric_clock(changed_ps));
}

static void disturb_cable(struct fabric *f, enum cable_fault fault, int64_t value)
{
    struct encoder *e = &model(f)->encoder;
    switch (fault) {
    case CABLE_CUT:
        encoder_cut(e, value != 0);
        break;
    case CABLE_FROZEN:
        encoder_freeze(e, value != 0);
        break;
    case CABLE_REVERSED:
        encoder_reverse(e, value != 0);
        break;
    case CABLE_ILLEGAL:
        encoder_illegal(e);
        break;
    default:
        encoder_slip(e, value);
        break;
    }
}

static void disguise(struct fabric *f, bool other)
{
    model(f)->gate.id_xor = other ? 1u : 0u;
}

static bool waits(const struct fabric *f)
{
    return pwm_waits(&looked_at(f)->pwm);
}

/* ---- registers ---- */

static uint32_t read(struct fabric *f, uint32_t offset, sim_ps now)
{
    struct fabric_model *m = model(f);
    uint32_t within = offset % SLOT_BYTES;
    catch_up(f, now);
    switch (offset % 4 != 0 ? SLOTS : offset / SLOT_BYTES) {
    case SLOT_PWM:
        return pwm_read(&m->pwm, within);
    case SLOT_ADC:
        return adc_read(&m->adc, within);
    case SLOT_ENCODER:
        return encoder_read(&m->encoder, within);
    case SLOT_GATE:
        gate_mirror(&m->gate, encoder_faulty(&m->encoder), adc_overran(&m->adc), adc_beyond_limit(&m->adc));
        return gate_read(&m->gate, within);
    default:
        return 0;
    }
}

static void write(struct fabric *f, uint32_t offset, uint32_t value, sim_ps now)
{
    struct fabric_model *m = model(f);
    uint32_t within = offset % SLOT_BYTES;
    catch_up(f, now);
    switch (offset % 4 != 0 ? SLOTS : offset / SLOT_BYTES) {
    case SLOT_PWM:
        pwm_write(&m->pwm, within, value);
        if (within == PWM_COMPARE_C_OFFSET) {
            gate_committed(&m->gate);
        }
        break;
    case SLOT_ADC:
        adc_write(&m->adc, within, value);
        break;
    case SLOT_ENCODER:
        encoder_write(&m->encoder, within, value);
        break;
    case SLOT_GATE:
        gate_write(&m->gate, within, value, now);
        break;
    default:
        break;
    }
    drive_gates(m, now);
}

void fabric_model_init(struct fabric_model *m, sim_ps conversion, bool in_en)
{
    static const struct fabric_ops ops = {reset,         read,          write,
                                          next_event,    needs_physics, take_event,
                                          catch_up,      next_trigger,  next_conversion_end,
                                          listens,       convert,       sample,
                                          converting,    sense,         NULL,
                                          stop,          turn,          show_hall,
                                          disturb_cable, disguise,      waits};
    memset(m, 0, sizeof *m);
    m->fabric.ops = &ops;
    m->conversion = conversion;
    m->gate.in_en = in_en;
    m->sto = (struct sto){.longest = STO_TEST, .patience = STO_PATIENCE};
}

void fabric_model_join(struct fabric_model *m, unsigned axis, unsigned axes, const struct fabric_model *leader)
{
    m->gate.axis = axis;
    m->gate.others = axes - 1;
    m->pwm.leader = leader ? &leader->pwm : NULL;
}
