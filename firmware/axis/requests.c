/* SPDX-License-Identifier: MIT */
/* The drive's commands: checked here, in the thread, and carried out by the next step of the state machine. */
#include "drivers/cortex/cpu.h"
#include "drivers/mss/sysreg.h"
#include "firmware/axis/axis.h"
#include "lib/q15.h"

bool axis_is_off(const struct axis *a)
{
    return a->request == AXIS_REQUEST_NONE && (a->state == AXIS_SWITCH_ON_DISABLED || a->state == AXIS_FAULT);
}

/* What has changed in the encoder's setting, if anything, makes the alignment void. Thread, bridge off. */
static void adopt_tuning(struct axis *a, const struct tuning *t)
{
    const uint32_t mask = cpu_irq_save();
    if (t->encoder_scale_q32 != a->tuning.encoder_scale_q32) {
        a->aligned = false;
        (void)encoder_init(&a->fabric->encoder, (uint32_t)a->params.encoder_counts, false);
        speed_estimate_reset(&a->speed.estimate);
    }
    a->tuning = *t;
    speed_loop_tune(&a->speed, t);
    cpu_irq_restore(mask);
}

struct outcome axis_switch_on(struct axis *a)
{
    struct tuning candidate;
    if (a->state == AXIS_FAULT || a->state == AXIS_FAULT_REACTION) {
        return outcome_of(ERROR_FAULT_LATCHED);
    }
    if (!axis_is_off(a)) {
        return outcome_of(ERROR_ALREADY_ON);
    }
    const struct outcome problem = tuning_compute(&a->params, &candidate);
    if (problem.error != ERROR_NONE) {
        return problem;
    }
    if (a->loop.vbus_q15 < candidate.v_min_q15) {
        return outcome_of(ERROR_BUS_LOW);
    }
    if (a->loop.vbus_q15 > candidate.v_max_q15) {
        return outcome_of(ERROR_BUS_HIGH);
    }
    if (q15_abs(a->speed.speed_rpm_q4) > AXIS_STANDSTILL_RPM_Q4) {
        return outcome_of(ERROR_TURNING);
    }
    adopt_tuning(a, &candidate);
    a->request = AXIS_REQUEST_ON;
    return OUTCOME_OK;
}

struct outcome axis_switch_off(struct axis *a)
{
    a->request = AXIS_REQUEST_OFF; /* always allowed, also when off */
    return OUTCOME_OK;
}

struct outcome axis_quick_stop(struct axis *a)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        return outcome_of(ERROR_NOT_OPERATING);
    }
    a->request = AXIS_REQUEST_QUICK_STOP;
    return OUTCOME_OK;
}

struct outcome axis_clear_fault(struct axis *a)
{
    if (a->state != AXIS_FAULT) {
        return outcome_of(ERROR_NO_FAULT);
    }
    encoder_clear(&a->fabric->encoder, ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST);
    if (gate_clear(&a->fabric->gate, GATE_STATUS_LATCHES) != 0u) {
        return outcome_of(ERROR_GATE_INPUT_ACTIVE);
    }
    if ((encoder_status(&a->fabric->encoder) & (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)) != 0u) {
        return outcome_of(ERROR_NO_ENCODER_SIGNAL);
    }
    if (!gate_id_ok(&a->fabric->gate)) {
        return outcome_of(ERROR_FABRIC);
    }
    if (!sysreg_clocks_match_board()) {
        return outcome_of(ERROR_CLOCK);
    }
    a->request = AXIS_REQUEST_CLEAR;
    return OUTCOME_OK;
}

struct outcome axis_command_speed(struct axis *a, int32_t rpm)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        return outcome_of(ERROR_NOT_OPERATING);
    }
    if (rpm > a->params.speed_max_rpm || rpm < -a->params.speed_max_rpm) {
        return outcome_of(ERROR_BEYOND_SPEED_MAX);
    }
    const uint32_t mask = cpu_irq_save();
    if (a->mode != AXIS_MODE_SPEED) {
        speed_loop_reset(&a->speed, a->loop.i_q_ref_q15);
        a->mode = AXIS_MODE_SPEED;
    }
    a->speed.target_rpm_q16 = rpm * 65536;
    cpu_irq_restore(mask);
    return OUTCOME_OK;
}

struct outcome axis_command_current(struct axis *a, int32_t milliamp)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        return outcome_of(ERROR_NOT_OPERATING);
    }
    if (milliamp > a->params.i_max_ma || milliamp < -a->params.i_max_ma) {
        return outcome_of(ERROR_BEYOND_I_MAX);
    }
    a->i_command_q15 = tuning_q15_from_milli(milliamp, a->params.i_range_ma);
    a->mode = AXIS_MODE_TORQUE;
    return OUTCOME_OK;
}
