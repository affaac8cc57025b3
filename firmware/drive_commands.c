/* SPDX-License-Identifier: MIT */
/* The drive's commands: checked here, in the thread, and carried out by the next step of the state machine. */
#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/encoder.h"
#include "drivers/fabric/gate.h"
#include "drivers/mss/sysreg.h"
#include "firmware/current_loop.h"
#include "firmware/drive.h"
#include "firmware/speed_loop.h"
#include "lib/q15.h"

bool drive_is_off(void)
{
    return drive.request == DRIVE_REQUEST_NONE &&
           (drive.state == DRIVE_SWITCH_ON_DISABLED || drive.state == DRIVE_FAULT);
}

/* What has changed in the encoder's setting, if anything, makes the alignment void. Thread, bridge off. */
static void adopt_tuning(const struct tuning *t)
{
    const uint32_t mask = cpu_irq_save();
    if (t->encoder_scale_q32 != drive.tuning.encoder_scale_q32) {
        drive.aligned = false;
        encoder_init((uint32_t)params.encoder_counts, false);
    }
    drive.tuning = *t;
    cpu_irq_restore(mask);
}

const char *drive_switch_on(void)
{
    static struct tuning candidate;
    if (drive.state == DRIVE_FAULT || drive.state == DRIVE_FAULT_REACTION) {
        return "a fault is latched; see 'fault', then 'clear'";
    }
    if (!drive_is_off()) {
        return "the drive is on already";
    }
    const char *problem = tuning_compute(&params, &candidate);
    if (problem != NULL) {
        return problem;
    }
    if (current_loop.vbus_q15 < candidate.v_min_q15) {
        return "the bus voltage is below v_min_mv; see 'status'";
    }
    if (current_loop.vbus_q15 > candidate.v_max_q15) {
        return "the bus voltage is above v_max_mv; see 'status'";
    }
    if (q15_abs(speed_loop.speed_rpm_q4) > DRIVE_STANDSTILL_RPM_Q4) {
        return "the motor is turning; wait until it stands still";
    }
    adopt_tuning(&candidate);
    drive.request = DRIVE_REQUEST_ON;
    return NULL;
}

const char *drive_switch_off(void)
{
    drive.request = DRIVE_REQUEST_OFF; /* always allowed, also when off */
    return NULL;
}

const char *drive_quick_stop(void)
{
    if (drive.state != DRIVE_OPERATION_ENABLED) {
        return "the drive is not in operation";
    }
    drive.request = DRIVE_REQUEST_QUICK_STOP;
    return NULL;
}

const char *drive_clear_fault(void)
{
    if (drive.state != DRIVE_FAULT) {
        return "no fault is latched";
    }
    encoder_clear(ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST);
    if (gate_clear(GATE_STATUS_LATCHES) != 0u) {
        return "the cause is still there: an input of the gate driver is active";
    }
    if ((encoder_status() & (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)) != 0u) {
        return "the cause is still there: no encoder signal";
    }
    if (!gate_id_ok()) {
        return "the cause is still there: the fabric does not carry the expected design";
    }
    if (!sysreg_clocks_match_board()) {
        return "the cause is still there: the clock ratios are not those of the board";
    }
    drive.request = DRIVE_REQUEST_CLEAR;
    return NULL;
}

const char *drive_command_speed(int32_t rpm)
{
    if (drive.state != DRIVE_OPERATION_ENABLED) {
        return "the drive is not in operation; use 'on' and wait for it";
    }
    if (rpm > params.speed_max_rpm || rpm < -params.speed_max_rpm) {
        return "beyond speed_max_rpm";
    }
    const uint32_t mask = cpu_irq_save();
    if (drive.mode != DRIVE_MODE_SPEED) {
        speed_loop_reset(current_loop.i_q_ref_q15);
        drive.mode = DRIVE_MODE_SPEED;
    }
    speed_loop.target_rpm_q16 = rpm * 65536;
    cpu_irq_restore(mask);
    return NULL;
}

const char *drive_command_current(int32_t milliamp)
{
    if (drive.state != DRIVE_OPERATION_ENABLED) {
        return "the drive is not in operation; use 'on' and wait for it";
    }
    if (milliamp > params.i_max_ma || milliamp < -params.i_max_ma) {
        return "beyond i_max_ma";
    }
    drive.i_command_q15 = tuning_q15_from_milli(milliamp, params.i_range_ma);
    drive.mode = DRIVE_MODE_TORQUE;
    return NULL;
}
