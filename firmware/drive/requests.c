/* SPDX-License-Identifier: MIT */
/* The drive's commands: checked here, in the thread, and executed by the next step of the state machine. */
#include "firmware/drive/requests.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/retry.h"
#include "firmware/monitor/device.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

bool request_settled(const struct axis *a)
{
    for (uint32_t poll = 0; poll < REQUEST_TIMEOUT_POLLS; poll++) {
        if (a->request == AXIS_REQUEST_NONE) {
            return true;
        }
    }
    return false;
}

uint32_t request_hold(void)
{
    return cpu_mask_below(CONFIG_PRIORITY_SLOW_LOOP);
}

void request_release(uint32_t before)
{
    (void)cpu_mask_below(before);
}

bool drive_is_off(const struct axis *a)
{
    return !a->switching.under_way && request_settled(a) &&
           (a->state == AXIS_SWITCH_ON_DISABLED || a->state == AXIS_FAULT);
}

/* Bursts of one axis and search pulses of the other: the slow loop has no time for both. */
static bool other_axis_identifies(const struct axis *a)
{
    return a->other_axis != NULL && a->other_axis->identify.running;
}

static bool other_axis_catches(const struct axis *a)
{
    return a->other_axis != NULL && source_has(a->other_axis->tuning.angle_source, SOURCE_CATCHES) &&
           (a->other_axis->switching.under_way || a->other_axis->state == AXIS_SWITCHED_ON);
}

enum error drive_state_forbids_on(const struct axis *a)
{
    if (other_axis_identifies(a) && source_has((uint32_t)a->params.angle_source, SOURCE_CATCHES)) {
        return ERROR_IDENTIFY_BESIDE;
    }
    if (a->state == AXIS_FAULT || a->state == AXIS_FAULT_REACTION || a->faults.cause != FAULT_NONE) {
        return ERROR_FAULT_LATCHED;
    }
    const bool off = a->state == AXIS_SWITCH_ON_DISABLED && !a->switching.under_way;
    return off ? ERROR_NONE : ERROR_ALREADY_ON;
}

struct outcome drive_measured_forbids_on(const struct axis *a, const struct tuning *t)
{
    const volatile struct current_loop *const loop = &a->loop;
    if (loop->vbus_q15 < t->v_min_q15) {
        return (struct outcome){ERROR_BUS_LOW, a->params.v_min_mv};
    }
    if (loop->vbus_q15 > t->v_max_q15) {
        return (struct outcome){ERROR_BUS_HIGH, a->params.v_max_mv};
    }
    if (thermal_winding_too_hot(&a->thermal) || thermal_inverter_too_hot(&a->thermal)) {
        return outcome_of(ERROR_TOO_HOT);
    }
    const bool caught = source_has(t->angle_source, SOURCE_CATCHES);
    const bool turns = q15_abs(a->speed.speed_rpm_q4) > AXIS_STANDSTILL_RPM_Q4 && !caught;
    return outcome_of(turns ? ERROR_TURNING : ERROR_NONE);
}

/* Discards what is known of the encoder: until it is measured, one pole pair is assumed. */
struct outcome drive_identify(struct axis *a)
{
    if (!request_settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    if (drive_state_forbids_on(a) != ERROR_NONE) {
        return outcome_of(drive_state_forbids_on(a));
    }
    if (other_axis_identifies(a) || other_axis_catches(a)) {
        return outcome_of(other_axis_identifies(a) ? ERROR_IDENTIFY_BESIDE : ERROR_CATCHES_BESIDE);
    }
    struct outcome problem = identify_begin(&a->identify, &a->params);
    if (problem.error != ERROR_NONE) {
        return problem;
    }
    const uint32_t held = request_hold();
    problem = drive_measured_forbids_on(a, &a->identify.tuning);
    if (problem.error == ERROR_NONE) {
        problem = outcome_of(drive_state_forbids_on(a));
    }
    if (problem.error == ERROR_NONE) {
        retry_withdraw(&a->retry); /* no retry after a fault */
        a->request = AXIS_REQUEST_IDENTIFY;
    } else {
        identify_stop(&a->identify, FAULT_NONE);
    }
    request_release(held);
    return problem;
}

struct outcome drive_identify_use(struct axis *a)
{
    if (!drive_is_off(a)) {
        return outcome_of(ERROR_DRIVE_IS_ON);
    }
    return (struct outcome){ERROR_NONE, (int32_t)identify_use(&a->identify, &a->params)};
}

struct outcome drive_forget(struct axis *a)
{
    if (!drive_is_off(a)) {
        return outcome_of(ERROR_DRIVE_IS_ON);
    }
    start_forget(a);
    return OUTCOME_OK;
}

void drive_withdraw(struct axis *a)
{
    retry_withdraw(&a->retry);
    switching_end(&a->switching, ERROR_SWITCHED_OFF);
}

/* Always allowed, also when off. */
struct outcome drive_switch_off(struct axis *a)
{
    drive_withdraw(a);
    if (axis_fabric_is_untrusted(a)) {
        return OUTCOME_OK;
    }
    if (!request_settled(a)) {
        gate_disable(&a->fabric->gate); /* the slow loop has stopped */
    }
    a->request = AXIS_REQUEST_OFF;
    return OUTCOME_OK;
}

bool drive_is_on(const struct axis *a)
{
    const uint32_t state = a->state;
    return state == AXIS_READY || state == AXIS_SWITCHED_ON || state == AXIS_OPERATION_ENABLED ||
           state == AXIS_QUICK_STOP;
}

/* Also cancels a pending switch-on. */
struct outcome drive_quick_stop(struct axis *a)
{
    const bool waited = a->switching.under_way || a->retry.waiting || a->retry.due;
    drive_withdraw(a);
    if (!request_settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    const uint32_t held = request_hold();
    const bool on = drive_is_on(a);
    if (on) {
        a->request = AXIS_REQUEST_QUICK_STOP;
    }
    request_release(held);
    return outcome_of(on || waited ? ERROR_NONE : ERROR_NOT_OPERATING);
}

/* Why the device does not allow a fault to be cleared. */
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

/* Clears the fabric's latches whose causes are gone. */
static enum error clear_latches(struct axis *a)
{
    encoder_clear(&a->fabric->encoder, ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST);
    if (gate_clear(&a->fabric->gate, GATE_STATUS_LATCHES) != 0u) {
        return ERROR_GATE_INPUT_ACTIVE;
    }
    if (rotor_has_encoder(a) &&
        (encoder_status(&a->fabric->encoder) & (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)) != 0u) {
        return ERROR_NO_ENCODER_SIGNAL;
    }
    return ERROR_NONE;
}

struct outcome drive_clear_fault(struct axis *a)
{
    const bool waited = a->retry.due; /* already cleared for a restart, which this cancels */
    retry_forget(&a->retry);
    if (a->faults.cause != FAULT_NONE || waited) {
        switching_end(&a->switching, ERROR_FAULT_LATCHED); /* a switch-on that the fault, or a retry, has overtaken */
    }
    const struct outcome outcome = drive_clear_latches(a);
    return waited && outcome.error == ERROR_NO_FAULT ? OUTCOME_OK : outcome;
}

struct outcome drive_clear_latches(struct axis *a)
{
    if (!request_settled(a) || a->state == AXIS_FAULT_REACTION) {
        return outcome_of(ERROR_BUSY);
    }
    if (a->state != AXIS_FAULT) {
        return outcome_of(ERROR_NO_FAULT);
    }
    if (axis_fabric_is_untrusted(a)) {
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

struct outcome drive_choose_reaction(struct axis *a, enum fault cause, enum reaction choice)
{
    if (!drive_is_off(a)) {
        return outcome_of(ERROR_DRIVE_IS_ON);
    }
    if (fault_reaction_is_absent(cause, choice)) {
        return feature_absent(FEATURE_SENSORLESS);
    }
    if (((fault_class(cause)->allowed >> choice) & 1u) == 0u) {
        return outcome_of(ERROR_REACTION_NOT_ALLOWED);
    }
    a->reactions.choice[cause] = (uint8_t)choice;
    return OUTCOME_OK;
}

/* ==== their effect on retries ==== */

void retry_withdraw(struct retry *r)
{
    r->wanted = false;
    r->waiting = false;
    r->due = false;
    r->resumes = false;
}

void retry_forget(struct retry *r)
{
    retry_withdraw(r);
    r->count = 0;
}

void retry_accept(struct retry *r)
{
    r->start_rpm_q16 = r->resumes ? r->resume_rpm_q16 : 0;
    r->resumes = false;
    r->due = false;
    r->wanted = true;
}
