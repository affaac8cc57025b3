/* SPDX-License-Identifier: MIT */
/* The drive's commands: checked here, in the thread, and carried out by the next step of the state machine. */
#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/axis/device.h"
#include "firmware/settings/config.h"
#include "lib/q15.h"

/* Twice as long as a slow loop that lives takes: each turn of the wait is at least five cycles. */
#define PATIENCE_POLLS (2u * BOARD_M3_HZ / CONFIG_SLOW_HZ / 5u)

/* Waits until the request before this one has been taken; false if nobody takes it. */
static bool settled(const struct axis *a)
{
    for (uint32_t poll = 0; poll < PATIENCE_POLLS; poll++) {
        if (a->request == AXIS_REQUEST_NONE) {
            return true;
        }
    }
    return false;
}

/* What is checked and done between these two, the slow loop sees before or after, not in between. The current loop runs on. */
static uint32_t hold_slow_loop(void)
{
    return cpu_mask_below(CONFIG_PRIORITY_SLOW_LOOP);
}

static void release_slow_loop(uint32_t before)
{
    (void)cpu_mask_below(before);
}

bool axis_is_off(const struct axis *a)
{
    return settled(a) && (a->state == AXIS_SWITCH_ON_DISABLED || a->state == AXIS_FAULT);
}

static enum error state_forbids_on(const struct axis *a)
{
    if (a->state == AXIS_FAULT || a->state == AXIS_FAULT_REACTION || a->faults.cause != FAULT_NONE) {
        return ERROR_FAULT_LATCHED;
    }
    return a->state == AXIS_SWITCH_ON_DISABLED ? ERROR_NONE : ERROR_ALREADY_ON;
}

/* What has changed in the encoder's setting, if anything, makes the alignment void. Slow loop held, bridge off. */
static void adopt_tuning(struct axis *a, const struct tuning *t)
{
    if (t->encoder_scale_q32 != a->tuning.encoder_scale_q32) {
        start_forget(a);
        (void)encoder_init(&a->fabric->encoder, (uint32_t)a->params.encoder_counts, false);
        speed_estimate_reset(&a->speed.estimate);
    }
    a->start.unseen = a->start.unseen || t->samples > a->tuning.samples;
    a->tuning = *t;
    speed_loop_tune(&a->speed, t);
    thermal_tune(&a->thermal, &a->params);
}

static struct outcome measured_forbids_on(const struct axis *a, const struct tuning *t)
{
    const volatile struct current_loop *const loop = &a->loop;
    if (loop->vbus_q15 < t->v_min_q15) {
        return outcome_of(ERROR_BUS_LOW);
    }
    if (loop->vbus_q15 > t->v_max_q15) {
        return outcome_of(ERROR_BUS_HIGH);
    }
    if (thermal_winding_too_hot(&a->thermal) || thermal_inverter_too_hot(&a->thermal)) {
        return outcome_of(ERROR_TOO_HOT);
    }
    const bool turns = q15_abs(a->speed.speed_rpm_q4) > AXIS_STANDSTILL_RPM_Q4;
    return outcome_of(turns ? ERROR_TURNING : ERROR_NONE);
}

struct outcome axis_switch_on(struct axis *a)
{
    struct tuning candidate;
    if (!settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    if (state_forbids_on(a) != ERROR_NONE) {
        return outcome_of(state_forbids_on(a));
    }
    struct outcome problem = tuning_compute(&a->params, &candidate);
    if (problem.error != ERROR_NONE) {
        return problem;
    }
    torque_map_build(&a->torque.map, &a->params, &candidate); /* nobody looks at it while the bridge is off */
    const uint32_t held = hold_slow_loop();
    problem = measured_forbids_on(a, &candidate);
    if (problem.error == ERROR_NONE) {
        problem = outcome_of(state_forbids_on(a)); /* a fault may have come meanwhile */
    }
    if (problem.error == ERROR_NONE) {
        adopt_tuning(a, &candidate);
        a->request = AXIS_REQUEST_ON;
    }
    release_slow_loop(held);
    return problem;
}

/* Always allowed, also when off. */
struct outcome axis_switch_off(struct axis *a)
{
    reaction_cleared_by_hand(&a->reactions);
    if (axis_fabric_doubted(a)) {
        return OUTCOME_OK;
    }
    if (!settled(a)) {
        gate_disable(&a->fabric->gate); /* the slow loop is dead: it will not */
    }
    a->request = AXIS_REQUEST_OFF;
    return OUTCOME_OK;
}

struct outcome axis_quick_stop(struct axis *a)
{
    if (!settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    const uint32_t held = hold_slow_loop();
    const bool allowed = a->state == AXIS_OPERATION_ENABLED;
    if (allowed) {
        a->request = AXIS_REQUEST_QUICK_STOP;
    }
    release_slow_loop(held);
    return outcome_of(allowed ? ERROR_NONE : ERROR_NOT_OPERATING);
}

/* Why the device's side does not let a fault go. */
static enum error device_error(void)
{
    switch (device_fault()) {
    case FAULT_CLOCK:
        return ERROR_CLOCK;
    case FAULT_STACK_GUARD:
        return ERROR_STACK_GUARD;
    case FAULT_WATCHDOG_OFF:
        return ERROR_WATCHDOG_OFF;
    default:
        return ERROR_NONE;
    }
}

/* Clears what the fabric has latched, as far as its causes are gone. */
static enum error clear_latches(struct axis *a)
{
    encoder_clear(&a->fabric->encoder, ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST);
    if (gate_clear(&a->fabric->gate, GATE_STATUS_LATCHES) != 0u) {
        return ERROR_GATE_INPUT_ACTIVE;
    }
    if ((encoder_status(&a->fabric->encoder) & (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)) != 0u) {
        return ERROR_NO_ENCODER_SIGNAL;
    }
    return ERROR_NONE;
}

struct outcome axis_clear_fault(struct axis *a)
{
    reaction_cleared_by_hand(&a->reactions);
    return axis_clear_latches(a);
}

struct outcome axis_clear_latches(struct axis *a)
{
    if (!settled(a) || a->state == AXIS_FAULT_REACTION) {
        return outcome_of(ERROR_BUSY);
    }
    if (a->state != AXIS_FAULT) {
        return outcome_of(ERROR_NO_FAULT);
    }
    if (axis_fabric_doubted(a)) {
        return outcome_of(ERROR_FABRIC_DOUBTED);
    }
    enum error problem = device_error();
    if (problem == ERROR_NONE && !gate_id_ok(&a->fabric->gate)) {
        problem = ERROR_FABRIC;
    }
    if (problem == ERROR_NONE) {
        problem = clear_latches(a);
    }
    if (problem == ERROR_NONE) {
        a->request = AXIS_REQUEST_CLEAR;
    }
    return outcome_of(problem);
}

static enum error set_speed(struct axis *a, int32_t rpm)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        return ERROR_NOT_OPERATING;
    }
    if (rpm > a->params.speed_max_rpm || rpm < -a->params.speed_max_rpm) {
        return ERROR_BEYOND_SPEED_MAX;
    }
    if (a->mode != AXIS_MODE_SPEED) {
        speed_loop_reset(&a->speed, a->torque.torque_q15);
        a->mode = AXIS_MODE_SPEED;
    }
    a->speed.target_rpm_q16 = rpm * 65536;
    return ERROR_NONE;
}

static enum error set_current(struct axis *a, int32_t milliamp)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        return ERROR_NOT_OPERATING;
    }
    if (milliamp > a->params.i_max_ma || milliamp < -a->params.i_max_ma) {
        return ERROR_BEYOND_I_MAX;
    }
    const int32_t current_q15 = tuning_q15_from_milli(milliamp, a->params.i_range_ma);
    const int32_t torque_q15 = torque_map_reach(&a->torque.map, a->torque.map.current_q15, q15_abs(current_q15));
    a->torque_command_q15 = current_q15 < 0 ? -torque_q15 : torque_q15;
    a->mode = AXIS_MODE_TORQUE;
    return ERROR_NONE;
}

/* The check and the values that it lets change belong together: a quick stop must not come in between. */
struct outcome axis_command_speed(struct axis *a, int32_t rpm)
{
    if (!settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    const uint32_t held = hold_slow_loop();
    const enum error problem = set_speed(a, rpm);
    release_slow_loop(held);
    return outcome_of(problem);
}

struct outcome axis_command_current(struct axis *a, int32_t milliamp)
{
    if (!settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    const uint32_t held = hold_slow_loop();
    const enum error problem = set_current(a, milliamp);
    release_slow_loop(held);
    return outcome_of(problem);
}
