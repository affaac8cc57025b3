/* SPDX-License-Identifier: MIT */
#include "firmware/drive.h"

#include "drivers/fabric/adc.h"
#include "drivers/fabric/corepwm.h"
#include "drivers/fabric/gate.h"
#include "firmware/alignment.h"
#include "firmware/calibration.h"
#include "firmware/config.h"
#include "firmware/current_loop.h"
#include "firmware/speed_loop.h"
#include "lib/q15.h"

#define STALL_MS          500u
#define QUICK_STOP_MS     5000u
#define LOOP_START_MS     2u /* until CorePWM's first periods have passed */
#define QUICK_STOP_FACTOR 4  /* times the normal ramp */

enum start_phase {
    START_CALIBRATE,
    START_PWM, /* one step for the PWM to run before the gates open */
    START_ALIGN,
};

struct drive drive;

static uint32_t start_phase;
static uint32_t stalled_ms;
static uint32_t stopping_ms;
static uint32_t heartbeat;

static void enter(enum drive_state state)
{
    drive.state = state;
}

static void bridge_off(void)
{
    current_loop_off();
    corepwm_enable_legs(false);
}

static void begin_operation(void)
{
    speed_loop_reset(0);
    drive.mode = DRIVE_MODE_SPEED;
    speed_loop.target_rpm_q16 = 0;
    stalled_ms = 0;
    enter(DRIVE_OPERATION_ENABLED);
}

static void step_calibration(void)
{
    switch (calibration_step()) {
    case CALIBRATION_DONE:
        corepwm_enable_legs(true);
        start_phase = START_PWM;
        break;
    case CALIBRATION_OUT_OF_RANGE:
        fault_raise(FAULT_CURRENT_OFFSET);
        break;
    case CALIBRATION_RUNNING:
    default:
        break;
    }
}

static void step_alignment(void)
{
    switch (alignment_step(&drive.tuning)) {
    case ALIGNMENT_DONE:
        drive.aligned = true;
        begin_operation();
        break;
    case ALIGNMENT_NOT_FOLLOWED:
        fault_raise(FAULT_ENCODER);
        break;
    case ALIGNMENT_RUNNING:
    default:
        break;
    }
}

static void step_switched_on(void)
{
    switch (start_phase) {
    case START_CALIBRATE:
        step_calibration();
        break;
    case START_PWM:
        if (!drive.aligned) {
            alignment_start();
        }
        current_loop_on(&drive.tuning);
        start_phase = START_ALIGN;
        break;
    case START_ALIGN:
    default:
        if (drive.aligned) {
            begin_operation();
        } else {
            step_alignment();
        }
        break;
    }
}

static void watch_for_stall(void)
{
    const bool stuck = speed_loop.at_limit && q15_abs(speed_loop.speed_rpm_q4) < DRIVE_STANDSTILL_RPM_Q4;
    stalled_ms = stuck ? stalled_ms + 1u : 0u;
    if (stalled_ms >= STALL_MS) {
        fault_raise(FAULT_STALL);
    }
}

static void step_operation(void)
{
    const int32_t limit_q15 = speed_loop_current_limit(&drive.tuning);
    if (drive.mode == DRIVE_MODE_TORQUE) {
        current_loop.i_q_ref_q15 = q15_clamp(drive.i_command_q15, -limit_q15, limit_q15);
        return;
    }
    current_loop.i_q_ref_q15 = speed_loop_step(&drive.tuning, drive.tuning.ramp_q16, limit_q15);
    watch_for_stall();
}

static void step_quick_stop(void)
{
    const int32_t slope =
        (int32_t)q15_clamp(drive.tuning.ramp_q16, 1, INT32_MAX / QUICK_STOP_FACTOR) * QUICK_STOP_FACTOR;
    current_loop.i_q_ref_q15 = speed_loop_step(&drive.tuning, slope, speed_loop_current_limit(&drive.tuning));
    stopping_ms++;
    const bool stands = speed_loop.ref_rpm_q16 == 0 && q15_abs(speed_loop.speed_rpm_q4) < DRIVE_STANDSTILL_RPM_Q4;
    if (stands || stopping_ms >= QUICK_STOP_MS) {
        bridge_off();
        enter(DRIVE_SWITCH_ON_DISABLED);
    }
}

static void begin_quick_stop(void)
{
    if (drive.mode == DRIVE_MODE_TORQUE) {
        speed_loop_reset(current_loop.i_q_ref_q15);
    }
    drive.mode = DRIVE_MODE_SPEED;
    speed_loop.target_rpm_q16 = 0;
    stopping_ms = 0;
    enter(DRIVE_QUICK_STOP);
}

/* Requests were checked when they were made; what the state no longer allows is dropped. */
static void take_request(void)
{
    const uint32_t wanted = drive.request;
    drive.request = DRIVE_REQUEST_NONE;
    switch (wanted) {
    case DRIVE_REQUEST_ON:
        if (drive.state == DRIVE_SWITCH_ON_DISABLED) {
            current_loop_tune(&drive.tuning);
            enter(DRIVE_READY);
        }
        break;
    case DRIVE_REQUEST_OFF:
        if (drive.state != DRIVE_FAULT && drive.state != DRIVE_FAULT_REACTION) {
            bridge_off();
            enter(DRIVE_SWITCH_ON_DISABLED);
        }
        break;
    case DRIVE_REQUEST_QUICK_STOP:
        if (drive.state == DRIVE_OPERATION_ENABLED) {
            begin_quick_stop();
        }
        break;
    case DRIVE_REQUEST_CLEAR:
        if (drive.state == DRIVE_FAULT) {
            fault_forget();
            enter(DRIVE_SWITCH_ON_DISABLED);
        }
        break;
    default:
        break;
    }
}

/*
 * There must have been as many conversions as there should in the last period; one either way is phase. That the current loop
 * took each of them the fabric watches: one that is not taken is an overrun.
 */
static void watch_heartbeat(void)
{
    const uint32_t ran = adc_sequence() - heartbeat;
    heartbeat += ran;
    if (drive.time_ms <= LOOP_START_MS) {
        return;
    }
    if (ran + 1u < CONFIG_LOOPS_PER_SLOW || ran > CONFIG_LOOPS_PER_SLOW + 1u) {
        fault_raise(FAULT_LOOP_STOPPED);
    }
}

static void watch_speed(void)
{
    if (drive.state >= DRIVE_SWITCHED_ON && drive.state <= DRIVE_QUICK_STOP &&
        q15_abs(current_loop_w_q15()) > drive.tuning.overspeed_w_q15) {
        fault_raise(FAULT_OVERSPEED);
    }
}

/*
 * The current loop looks for latches while the bridge is on. If one is found here, the bridge is off; or conversions go
 * unanswered, and the current loop's interrupt has stopped.
 */
static void watch_latches(void)
{
    const uint32_t status = gate_status();
    if (drive.fault != FAULT_NONE || (status & GATE_STATUS_LATCHES) == 0u) {
        return;
    }
    const enum fault cause = fault_from_gate(status);
    fault_raise(cause == FAULT_LOOP_OVERRUN ? FAULT_LOOP_STOPPED : cause);
}

static void react_to_fault(void)
{
    bridge_off();
    drive.request = DRIVE_REQUEST_NONE;
    if (drive.fault == FAULT_ENCODER || drive.state == DRIVE_SWITCHED_ON) {
        drive.aligned = false;
    }
    enter(DRIVE_FAULT_REACTION);
}

static void step_state(void)
{
    switch (drive.state) {
    case DRIVE_READY:
        calibration_start();
        start_phase = START_CALIBRATE;
        enter(DRIVE_SWITCHED_ON);
        break;
    case DRIVE_SWITCHED_ON:
        step_switched_on();
        break;
    case DRIVE_OPERATION_ENABLED:
        step_operation();
        break;
    case DRIVE_QUICK_STOP:
        step_quick_stop();
        break;
    case DRIVE_FAULT_REACTION:
        if ((gate_status() & GATE_STATUS_LIVE) == 0u) {
            enter(DRIVE_FAULT);
        }
        break;
    default:
        break;
    }
}

void drive_step(void)
{
    drive.time_ms++;
    speed_loop_measure(&drive.tuning);
    watch_heartbeat();
    watch_speed();
    watch_latches();
    if (drive.fault != FAULT_NONE && drive.state != DRIVE_FAULT && drive.state != DRIVE_FAULT_REACTION) {
        react_to_fault();
    } else {
        take_request();
        step_state();
    }
    current_loop_follow(&drive.tuning);
}

void drive_start(enum fault boot_fault)
{
    (void)tuning_compute(&params, &drive.tuning); /* the initial values fit: a test says so */
    current_loop_tune(&drive.tuning);
    const bool running = current_loop_start((uint32_t)params.encoder_counts);
    enter(DRIVE_SWITCH_ON_DISABLED);
    if (!running) {
        fault_raise(FAULT_FABRIC);
    }
    if (boot_fault != FAULT_NONE) {
        fault_raise(boot_fault);
    }
}

const char *drive_state_name(enum drive_state state)
{
    static const char *const names[] = {
        [DRIVE_NOT_READY] = "not ready to switch on",
        [DRIVE_SWITCH_ON_DISABLED] = "switch on disabled",
        [DRIVE_READY] = "ready to switch on",
        [DRIVE_SWITCHED_ON] = "switched on",
        [DRIVE_OPERATION_ENABLED] = "operation enabled",
        [DRIVE_QUICK_STOP] = "quick stop active",
        [DRIVE_FAULT_REACTION] = "fault reaction active",
        [DRIVE_FAULT] = "fault",
    };
    return state < sizeof names / sizeof names[0] ? names[state] : "unknown";
}
