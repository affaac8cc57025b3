/* SPDX-License-Identifier: MIT */
#include "firmware/fault/fault.h"

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/adc.h"
#include "drivers/fabric/gate.h"
#include "firmware/axis/axis.h"
#include "firmware/control/bridge.h"
#include "firmware/settings/features.h"

#define OFF      (1u << REACTION_OFF)
#define STOP     (1u << REACTION_STOP)
#define WARN     (1u << REACTION_WARN)
#define CARRY    (FEATURE_IN(SENSORLESS) ? 1u << REACTION_CARRY : 0u)
#define SLOWER   (1u << REACTION_CARRY)
#define RETRY    true
#define NO_RETRY false

#define FAULT_CLASS(number, name, code, allowed, initial, retry, ...) \
    [FAULT_##name] = {allowed, REACTION_##initial, retry},

static const struct fault_class classes[FAULT_COUNT] = {FAULTS(FAULT_CLASS)};

const struct fault_class *fault_class(enum fault cause)
{
    static const struct fault_class off_only = {OFF, REACTION_OFF, false};
    return cause < FAULT_COUNT && classes[cause].allowed != 0u ? &classes[cause] : &off_only;
}

void fault_default_reactions(uint8_t choice[FAULT_COUNT])
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        choice[cause] = fault_class((enum fault)cause)->initial;
    }
}

bool fault_reaction_is_absent(enum fault cause, enum reaction choice)
{
    return !FEATURE_IN(SENSORLESS) && choice == REACTION_CARRY && cause != FAULT_OSCILLATION;
}

/* Safe torque off first: it often coincides with a loss of the drivers' supply. No loop: bounds the interrupt's time. */
enum fault fault_from_gate(uint32_t gate_flags)
{
    if ((gate_flags & GATE_STATUS_STO_APART) != 0u) {
        return FAULT_STO_APART;
    }
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
    if ((gate_flags & GATE_STATUS_LOOP_LOST) != 0u) {
        return FAULT_LOOP_OVERRUN;
    }
    return (gate_flags & (GATE_STATUS_SLOW_LOST | GATE_STATUS_THREAD_LOST)) != 0u ? FAULT_SLOW_LOOP_STOPPED
                                                                                  : FAULT_NONE;
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

/* ==== latching ==== */

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
    s->i_q_q15 = axis_forward(a) * a->loop.i_q_q15;
    s->vbus_q15 = sample.vbus_q15;
    s->speed_rpm_q4 = axis_forward(a) * a->speed.speed_rpm_q4;
    s->angle_u16 = current_loop_angle_u16(&a->loop);
    s->gate_status = gate_status(&a->fabric->gate);
}

bool fault_latch(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1)
{
    if (axis_fabric_is_untrusted(a)) { /* the gates are off since the reset, and nothing can be read */
        const bool none = a->faults.cause == FAULT_NONE;
        a->faults.cause = none ? cause : a->faults.cause;
        a->faults.count += none ? 1u : 0u;
        return none;
    }
    const uint32_t mask = cpu_irq_save(); /* two callers must not both find it clear */
    bridge_lock_out(&a->loop);
    const bool first = a->faults.cause == FAULT_NONE;
    if (first) {
        a->faults.cause = cause;
        a->faults.count++;
        a->faults.detail[0] = detail_0;
        a->faults.detail[1] = detail_1;
        take_snapshot(a);
    }
    cpu_irq_restore(mask);
    return first;
}

void fault_correct_cause(struct axis *a, enum fault cause)
{
    const uint32_t mask = cpu_irq_save();
    a->faults.cause = a->faults.cause == FAULT_NONE ? FAULT_NONE : cause;
    cpu_irq_restore(mask);
}

void fault_clear(struct axis *a)
{
    const uint32_t mask = cpu_irq_save(); /* a new fault is latched before both or after both */
    a->faults.cause = FAULT_NONE;
    bridge_unlock(&a->loop);
    cpu_irq_restore(mask);
}

void fault_raise_with(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1)
{
    bridge_lock_out(&a->loop); /* before the gates: a lower priority must not enable them again in between */
    if (!axis_fabric_is_untrusted(a)) {
        gate_disable(&a->fabric->gate);
    }
    (void)fault_latch(a, cause, detail_0, detail_1);
}

void fault_raise(struct axis *a, enum fault cause)
{
    fault_raise_with(a, cause, 0, 0);
}

/* ==== reporting ==== */

void fault_report(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1)
{
    struct fault_reports *const r = &a->reports;
    if (r->count < FAULT_REPORTS_MAX) {
        r->report[r->count] = (struct fault_report){cause, {detail_0, detail_1}};
        r->count++;
    } else {
        fault_raise_with(a, cause, detail_0, detail_1); /* no report is lost; so many at the same time justify OFF */
    }
}

void fault_warn(struct axis *a, enum fault cause)
{
    a->reports.warned[cause / 32u] |= 1u << (cause % 32u);
}

void fault_warn_while(struct axis *a, enum fault cause, bool lasts)
{
    if (lasts) {
        fault_warn(a, cause);
    } else {
        a->reports.warned[cause / 32u] &= ~(1u << (cause % 32u));
    }
}

bool fault_warned(const struct fault_reports *r, enum fault cause)
{
    return ((r->warned[cause / 32u] >> (cause % 32u)) & 1u) != 0u;
}

bool fault_any_warned(const struct fault_reports *r)
{
    uint32_t any = 0;
    for (uint32_t n = 0; n < FAULT_WORDS; n++) {
        any |= r->warned[n];
    }
    return any != 0u;
}

void fault_clear_warnings(struct fault_reports *r)
{
    for (uint32_t n = 0; n < FAULT_WORDS; n++) {
        r->warned[n] = 0;
    }
}
