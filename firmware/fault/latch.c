/* SPDX-License-Identifier: MIT */
#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/control/bridge.h"
#include "firmware/fault/fault.h"

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
    if (axis_fabric_doubted(a)) { /* the gates are off since the reset, and there is nothing to read */
        const bool none = a->faults.cause == FAULT_NONE;
        a->faults.cause = none ? cause : a->faults.cause;
        a->faults.count += none ? 1u : 0u;
        return none;
    }
    const uint32_t mask = cpu_irq_save(); /* two callers must not both find it empty */
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

void fault_forget(struct axis *a)
{
    const uint32_t mask = cpu_irq_save(); /* a new fault comes before both or after both */
    a->faults.cause = FAULT_NONE;
    bridge_unlock(&a->loop);
    cpu_irq_restore(mask);
}

void fault_raise_with(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1)
{
    bridge_lock_out(&a->loop); /* before the gates: a lower level must not enable them again in between */
    if (!axis_fabric_doubted(a)) {
        gate_disable(&a->fabric->gate);
    }
    (void)fault_latch(a, cause, detail_0, detail_1);
}

void fault_raise(struct axis *a, enum fault cause)
{
    fault_raise_with(a, cause, 0, 0);
}
