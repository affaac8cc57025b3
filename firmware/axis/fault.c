/* SPDX-License-Identifier: MIT */
#include "firmware/axis/fault.h"

#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/axis/rotor.h"
#include "firmware/control/bridge.h"

#define OFF   (1u << REACTION_OFF)
#define STOP  (1u << REACTION_STOP)
#define WARN  (1u << REACTION_WARN)
#define CARRY (1u << REACTION_CARRY)

/*
 * A stop needs a working current loop, encoder and bridge. A warning is allowed if going on does no harm by itself. Retry is
 * for what may pass: a supply, a load, heat.
 */
static const struct fault_class classes[FAULT_COUNT] = {
    [FAULT_ENCODER] = {OFF | CARRY, REACTION_OFF, false},
    [FAULT_OVERCURRENT] = {OFF, REACTION_OFF, true},
    [FAULT_OVERVOLTAGE] = {OFF, REACTION_OFF, true},
    [FAULT_UNDERVOLTAGE] = {OFF, REACTION_OFF, true},
    [FAULT_OVERSPEED] = {OFF | STOP, REACTION_OFF, false},
    [FAULT_STALL] = {OFF | WARN, REACTION_OFF, true},
    [FAULT_ENCODER_SLIP] = {OFF | CARRY, REACTION_OFF, false},
    [FAULT_ENCODER_DEAD] = {OFF | CARRY, REACTION_OFF, false},
    [FAULT_ENCODER_COUNTS] = {OFF | STOP | WARN | CARRY, REACTION_OFF, false},
    [FAULT_SPEED_DEVIATION] = {OFF | STOP | WARN, REACTION_OFF, true},
    [FAULT_OVERTEMPERATURE] = {OFF | STOP | WARN, REACTION_STOP, true},
    [FAULT_INVERTER_OVERLOAD] = {OFF | STOP | WARN, REACTION_STOP, true},
    [FAULT_VOLTAGE_LIMIT] = {OFF | STOP | WARN, REACTION_WARN, true},
    [FAULT_LIMIT_CYCLE] = {OFF | STOP | WARN, REACTION_OFF, false},
    [FAULT_FOLLOWING_ERROR] = {OFF | STOP | WARN, REACTION_STOP, false},
    [FAULT_HOMING] = {OFF | STOP, REACTION_STOP, false},
    [FAULT_LOCK_LOST] = {OFF, REACTION_OFF, true},
    [FAULT_OUT_OF_STEP] = {OFF, REACTION_OFF, true},
    [FAULT_HALL_INVALID] = {OFF | CARRY, REACTION_OFF, true},
    [FAULT_HALL_SEQUENCE] = {OFF | CARRY, REACTION_OFF, true},
    [FAULT_COMMAND_TIMEOUT] = {OFF | STOP | WARN, REACTION_STOP, false},
};

const struct fault_class *fault_class(enum fault cause)
{
    static const struct fault_class off_only = {OFF, REACTION_OFF, false};
    return cause < FAULT_COUNT && classes[cause].allowed != 0u ? &classes[cause] : &off_only;
}

static void take_snapshot(struct axis *a)
{
    struct fault_snapshot *const s = &a->faults.snapshot;
    const struct adc_sample sample = adc_read(&a->fabric->adc);
    s->up_ms = axis_up_ms(a);
    s->state = a->state;
    s->i_a_q15 = sample.ia_q15;
    s->i_b_q15 = sample.ib_q15;
    s->i_c_q15 = sample.ic_q15;
    s->i_d_q15 = a->loop.i_d_q15;
    s->i_q_q15 = a->loop.i_q_q15;
    s->vbus_q15 = sample.vbus_q15;
    s->speed_rpm_q4 = a->speed.speed_rpm_q4;
    s->angle_u16 = current_loop_angle_u16(&a->loop);
    s->gate_status = gate_status(&a->fabric->gate);
}

bool fault_latch(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1)
{
    if (axis_fabric_doubted(a)) { /* the gates are off since the reset, and there is nothing to read */
        const bool none = a->faults.cause == FAULT_NONE;
        a->faults.cause = none ? cause : a->faults.cause;
        return none;
    }
    const uint32_t mask = cpu_irq_save(); /* two callers must not both find it empty */
    bridge_lock_out(&a->loop);
    const bool first = a->faults.cause == FAULT_NONE;
    if (first) {
        a->faults.cause = cause;
        a->faults.detail[0] = detail_0;
        a->faults.detail[1] = detail_1;
        take_snapshot(a);
    }
    cpu_irq_restore(mask);
    return first;
}

void fault_forget(struct axis *a)
{
    const uint32_t mask = cpu_irq_save(); /* a new fault comes before both or after both */
    a->faults.cause = FAULT_NONE;
    bridge_unlock(&a->loop);
    cpu_irq_restore(mask);
}

void axis_raise_with(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1)
{
    bridge_lock_out(&a->loop); /* before the gates: a lower level must not enable them again in between */
    if (!axis_fabric_doubted(a)) {
        gate_disable(&a->fabric->gate);
    }
    (void)fault_latch(a, cause, detail_0, detail_1);
}

void axis_raise(struct axis *a, enum fault cause)
{
    axis_raise_with(a, cause, 0, 0);
}

/* Safe torque off first: it may well come with a loss of the drivers' supply. No loop: the interrupt's time is bounded. */
enum fault fault_from_gate(uint32_t gate_flags)
{
    if ((gate_flags & GATE_STATUS_STO_A) != 0u) {
        return FAULT_STO_A;
    }
    if ((gate_flags & GATE_STATUS_STO_B) != 0u) {
        return FAULT_STO_B;
    }
    if ((gate_flags & GATE_STATUS_CLOCK_LOST) != 0u) {
        return FAULT_PLL;
    }
    if ((gate_flags & GATE_STATUS_OVERCURRENT) != 0u) {
        return FAULT_OVERCURRENT_HARDWARE;
    }
    if ((gate_flags & GATE_STATUS_DRIVER_FAULT) != 0u) {
        return FAULT_GATE_DRIVER;
    }
    if ((gate_flags & GATE_STATUS_INTERLOCK) != 0u) {
        return FAULT_INTERLOCK;
    }
    return (gate_flags & GATE_STATUS_LOOP_LOST) != 0u ? FAULT_LOOP_OVERRUN : FAULT_NONE;
}

enum fault fault_from_adc(uint32_t adc_flags)
{
    if ((adc_flags & ADC_STATUS_CURRENT) != 0u) {
        return FAULT_OVERCURRENT;
    }
    if ((adc_flags & ADC_STATUS_SUM) != 0u) {
        return FAULT_CURRENT_SUM;
    }
    if ((adc_flags & ADC_STATUS_VBUS_HIGH) != 0u) {
        return FAULT_OVERVOLTAGE;
    }
    return (adc_flags & ADC_STATUS_VBUS_LOW) != 0u ? FAULT_UNDERVOLTAGE : FAULT_NONE;
}

/* Switches that gave a wrong angle report it themselves later; they are named only if the drive carries on without them. */
static enum fault blamed_for_overcurrent(const struct axis *a)
{
    if (rotor_has_encoder(a)) {
        return supervise_encoder_blame(a, FAULT_OVERCURRENT);
    }
    return rotor_has_hall(a) ? hall_watch_blame(a, FAULT_OVERCURRENT) : FAULT_OVERCURRENT;
}

/* Gates first: an over-current may result from something that has just begun, but none of its causes leaves them on. */
static void raise_overcurrent(struct axis *a)
{
    int32_t phase;
    gate_disable(&a->fabric->gate);
    if (supervise_phases_suspect(a, &phase)) {
        axis_raise_with(a, FAULT_OPEN_PHASE, phase, 0);
        return;
    }
    if (carry_bears_trip(a)) {
        return;
    }
    const enum fault cause = blamed_for_overcurrent(a);
    if (cause == FAULT_OVERCURRENT || !carry_from_sample(a, cause)) {
        axis_raise(a, rotor_has_encoder(a) ? cause : FAULT_OVERCURRENT);
    }
}

static void raise_encoder(struct axis *a)
{
    if (!carry_from_sample(a, FAULT_ENCODER)) {
        axis_raise(a, FAULT_ENCODER);
    }
}

/*
 * First cause: hardware latches before conclusions from a sample, and the cause of an over-current before the over-current.
 * Rare enough to branch.
 */
void axis_sample_fault(struct axis *a)
{
    const uint32_t gate = gate_status(&a->fabric->gate);
    const enum fault sampled = fault_from_adc(adc_status(&a->fabric->adc));
    if ((gate & GATE_STATUS_LATCHES) != 0u) {
        axis_raise(a, fault_from_gate(gate));
    } else if ((gate & GATE_STATUS_ENCODER) != 0u && rotor_has_encoder(a) && a->carry.waits == FAULT_NONE) {
        raise_encoder(a);
    } else if (sampled == FAULT_OVERCURRENT) {
        raise_overcurrent(a);
    } else if (sampled != FAULT_NONE) {
        axis_raise(a, sampled);
    } else if ((gate & GATE_STATUS_OVERRUN) != 0u) {
        axis_raise(a, FAULT_LOOP_OVERRUN);
    }
}
