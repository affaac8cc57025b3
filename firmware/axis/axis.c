/* SPDX-License-Identifier: MIT */
#include "firmware/axis/axis.h"

#include <stddef.h>

#include "firmware/settings/config.h"
#include "lib/q15.h"

#define QUICK_STOP_MS     5000u
#define LOOP_START_MS     2u /* until CorePWM's first periods have passed */
#define QUICK_STOP_FACTOR 4  /* times the normal ramp */

enum start_phase {
    START_CALIBRATE,
    START_PWM, /* one step for the PWM to run before the gates open */
    START_ALIGN,
};

static void enter(struct axis *a, enum axis_state state)
{
    a->state = state;
}

static void bridge_off(struct axis *a)
{
    current_loop_off(&a->loop, a->fabric);
    corepwm_enable_legs(&a->fabric->pwm, false);
}

static void begin_operation(struct axis *a)
{
    speed_loop_reset(&a->speed, 0);
    a->mode = AXIS_MODE_SPEED;
    a->speed.target_rpm_q16 = 0;
    supervision_begin(a);
    axis_hear(a);
    enter(a, AXIS_OPERATION_ENABLED);
}

static void step_calibration(struct axis *a)
{
    switch (calibration_step(&a->calibration, &a->fabric->adc)) {
    case CALIBRATION_DONE:
        corepwm_enable_legs(&a->fabric->pwm, true);
        a->start_phase = START_PWM;
        break;
    case CALIBRATION_OUT_OF_RANGE:
        axis_raise(a, FAULT_CURRENT_OFFSET);
        break;
    case CALIBRATION_RUNNING:
    default:
        break;
    }
}

static void step_alignment(struct axis *a)
{
    switch (alignment_step(&a->alignment, &a->loop, &a->tuning, a->speed.speed_rpm_q4)) {
    case ALIGNMENT_DONE:
        a->aligned = true;
        begin_operation(a);
        break;
    case ALIGNMENT_NOT_FOLLOWED:
        axis_raise(a, FAULT_ENCODER);
        break;
    case ALIGNMENT_RUNNING:
    default:
        break;
    }
}

static void step_switched_on(struct axis *a)
{
    switch (a->start_phase) {
    case START_CALIBRATE:
        step_calibration(a);
        break;
    case START_PWM:
        if (!a->aligned) {
            alignment_start(&a->alignment, &a->loop);
        }
        current_loop_on(&a->loop, a->fabric, &a->tuning);
        a->start_phase = START_ALIGN;
        break;
    case START_ALIGN:
    default:
        if (a->aligned) {
            begin_operation(a);
        } else {
            step_alignment(a);
        }
        break;
    }
}

static int32_t current_limit_q15(const struct axis *a)
{
    return q15_min(speed_loop_current_limit(&a->loop, &a->tuning),
                   thermal_i_limit_q15(&a->thermal, a->tuning.i_max_q15));
}

static void step_operation(struct axis *a)
{
    const int32_t limit_q15 = current_limit_q15(a);
    if (a->mode == AXIS_MODE_TORQUE) {
        a->loop.i_q_ref_q15 = q15_clamp(a->i_command_q15, -limit_q15, limit_q15);
        return;
    }
    a->loop.i_q_ref_q15 = speed_loop_step(&a->speed, &a->tuning, a->tuning.ramp_q16, limit_q15);
}

static void step_quick_stop(struct axis *a)
{
    const int32_t slope = (int32_t)q15_clamp(a->tuning.ramp_q16, 1, INT32_MAX / QUICK_STOP_FACTOR) * QUICK_STOP_FACTOR;
    a->loop.i_q_ref_q15 = speed_loop_step(&a->speed, &a->tuning, slope, current_limit_q15(a));
    a->stopping_ms++;
    const bool stands = a->speed.ref_rpm_q16 == 0 && q15_abs(a->speed.speed_rpm_q4) < AXIS_STANDSTILL_RPM_Q4;
    if (stands || a->stopping_ms >= QUICK_STOP_MS) {
        bridge_off(a);
        enter(a, AXIS_SWITCH_ON_DISABLED);
    }
}

static void begin_quick_stop(struct axis *a)
{
    if (a->mode == AXIS_MODE_TORQUE) {
        speed_loop_reset(&a->speed, a->loop.i_q_ref_q15);
    }
    a->mode = AXIS_MODE_SPEED;
    a->speed.target_rpm_q16 = 0;
    a->stopping_ms = 0;
    enter(a, AXIS_QUICK_STOP);
}

/* Requests were checked when they were made; what the state no longer allows is dropped. */
static void take_request(struct axis *a)
{
    const uint32_t wanted = a->request;
    a->request = AXIS_REQUEST_NONE;
    switch (wanted) {
    case AXIS_REQUEST_ON:
        if (a->state == AXIS_SWITCH_ON_DISABLED) {
            current_loop_tune(&a->loop, &a->tuning);
            reaction_begin(&a->reactions);
            enter(a, AXIS_READY);
        }
        break;
    case AXIS_REQUEST_OFF:
        if (a->state != AXIS_FAULT && a->state != AXIS_FAULT_REACTION) {
            bridge_off(a);
            enter(a, AXIS_SWITCH_ON_DISABLED);
        }
        break;
    case AXIS_REQUEST_QUICK_STOP:
        if (a->state == AXIS_OPERATION_ENABLED) {
            begin_quick_stop(a);
        }
        break;
    case AXIS_REQUEST_CLEAR:
        if (a->state == AXIS_FAULT) {
            a->faults.cause = FAULT_NONE;
            enter(a, AXIS_SWITCH_ON_DISABLED);
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
static void watch_heartbeat(struct axis *a)
{
    const uint32_t ran = adc_sequence(&a->fabric->adc) - a->heartbeat;
    a->heartbeat += ran;
    if (a->time_ms <= LOOP_START_MS) {
        return;
    }
    if (ran + 1u < CONFIG_LOOPS_PER_SLOW || ran > CONFIG_LOOPS_PER_SLOW + 1u) {
        axis_raise(a, FAULT_LOOP_STOPPED);
    }
}

/*
 * The current loop looks for latches while the bridge is on. If one is found here, the bridge is off; or conversions go
 * unanswered, and the current loop's interrupt has stopped.
 */
static void watch_latches(struct axis *a)
{
    const uint32_t status = gate_status(&a->fabric->gate);
    if (a->faults.cause != FAULT_NONE || (status & GATE_STATUS_LATCHES) == 0u) {
        return;
    }
    const enum fault cause = fault_from_gate(status);
    axis_raise(a, cause == FAULT_LOOP_OVERRUN ? FAULT_LOOP_STOPPED : cause);
}

/* What the encoder counts is no longer what alignment found. */
static bool spoils_alignment(uint32_t cause)
{
    return cause == FAULT_ENCODER || cause == FAULT_ENCODER_SLIP || cause == FAULT_ENCODER_DEAD ||
           cause == FAULT_ENCODER_COUNTS;
}

static void react_to_fault(struct axis *a)
{
    bridge_off(a);
    a->request = AXIS_REQUEST_NONE;
    a->reactions.stopping = false;
    if (spoils_alignment(a->faults.cause) || a->state == AXIS_SWITCHED_ON) {
        a->aligned = false;
    }
    enter(a, AXIS_FAULT_REACTION);
}

static void step_state(struct axis *a)
{
    switch (a->state) {
    case AXIS_READY:
        calibration_start(&a->calibration);
        a->start_phase = START_CALIBRATE;
        enter(a, AXIS_SWITCHED_ON);
        break;
    case AXIS_SWITCHED_ON:
        step_switched_on(a);
        break;
    case AXIS_OPERATION_ENABLED:
        step_operation(a);
        break;
    case AXIS_QUICK_STOP:
        step_quick_stop(a);
        break;
    case AXIS_FAULT_REACTION:
        if ((gate_status(&a->fabric->gate) & GATE_STATUS_LIVE) == 0u) {
            enter(a, AXIS_FAULT);
        }
        break;
    default:
        break;
    }
}

/* A fault whose reaction is a controlled stop: as long as the bridge is on, and nothing else has switched it off. */
static bool stops_under_control(struct axis *a)
{
    const bool running = a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
    if (!a->reactions.stopping || !running || (gate_status(&a->fabric->gate) & GATE_STATUS_LIVE) == 0u) {
        return false;
    }
    if (a->state == AXIS_OPERATION_ENABLED) {
        begin_quick_stop(a);
    }
    return true;
}

void axis_step(struct axis *a)
{
    a->time_ms++;
    speed_loop_measure(&a->speed, &a->loop, &a->tuning);
    watch_heartbeat(a);
    watch_latches(a);
    if (a->faults.cause != FAULT_NONE && a->state != AXIS_FAULT && a->state != AXIS_FAULT_REACTION &&
        !stops_under_control(a)) {
        react_to_fault(a);
    } else {
        take_request(a);
        step_state(a);
    }
    current_loop_follow(&a->loop, a->fabric, &a->tuning);
    supervision_step(a);
}

void axis_init(struct axis *a, struct fabric *fabric)
{
    *a = (struct axis){.fabric = fabric};
    current_loop_init(&a->loop);
    params_init(&a->params);
    (void)tuning_compute(&a->params, &a->tuning); /* the initial values fit: a test says so */
    current_loop_tune(&a->loop, &a->tuning);
    thermal_init(&a->thermal, NULL, &a->params);
    reaction_init(&a->reactions);
}

void axis_remember_heat(struct axis *a, struct thermal_memory *memory)
{
    thermal_init(&a->thermal, memory, &a->params);
}

/* Without the expected fabric or clock a register may be anything: then nothing is written, and the drive stays off. */
static bool fabric_in_doubt(enum fault boot_fault)
{
    return boot_fault == FAULT_CLOCK || boot_fault == FAULT_FABRIC;
}

static bool start_fabric(struct axis *a)
{
    (void)encoder_init(&a->fabric->encoder, (uint32_t)a->params.encoder_counts, false);
    const bool running = corepwm_init(&a->fabric->pwm, CONFIG_PWM_COUNTS);
    adc_start(&a->fabric->adc);
    return running;
}

void axis_start(struct axis *a, enum fault boot_fault)
{
    enter(a, AXIS_SWITCH_ON_DISABLED);
    if (boot_fault != FAULT_NONE) {
        axis_raise(a, boot_fault);
    }
    if (!fabric_in_doubt(boot_fault) && !start_fabric(a)) {
        axis_raise(a, FAULT_FABRIC);
    }
}
