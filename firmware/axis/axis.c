/* SPDX-License-Identifier: MIT */
#include "firmware/axis/axis.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "firmware/axis/modes_step.h"
#include "firmware/axis/rotor.h"
#include "firmware/axis/supervision_step.h"
#include "firmware/settings/config.h"
#include "lib/q15.h"
#include "lib/usually.h"

#define QUICK_STOP_MS     5000u
#define LOOP_START_MS     2u /* for the PWM's first periods to pass, or the first with another number of samples */
#define QUICK_STOP_FACTOR 4  /* times the normal ramp */
#define LIMITS_MS         2u /* torque.h: every second slow period */
#define THERMAL_TURN      3u /* of THERMAL_STEP_MS: where supervision has least to do */

_Static_assert(FAULT_NONE == 0 && AXIS_REQUEST_NONE == 0, "one comparison tells that there is neither");

static bool is_running(const struct axis *a)
{
    const uint32_t state = a->state;
    return state == AXIS_OPERATION_ENABLED || state == AXIS_QUICK_STOP;
}

static void enter(struct axis *a, enum axis_state state)
{
    a->state = state;
}

static void bridge_off(struct axis *a)
{
    current_loop_off(&a->loop, a->fabric);
    torque_reset(&a->torque);
}

static void begin_operation(struct axis *a)
{
    speed_loop_reset(&a->speed, 0);
    a->mode = AXIS_MODE_SPEED;
    a->speed.target_rpm_q16 = reaction_take_target(&a->reactions);
    modes_limit_torque(a);
    supervision_begin(a);
    axis_hear(a);
    enter(a, AXIS_OPERATION_ENABLED);
}

/* Time at the braking limit is not counted: the stop then takes as long as the limits require. */
static bool stop_takes_too_long(struct axis *a)
{
    a->stopping_ms++;
    a->lingering_ms += a->speed.at_limit ? 0u : 1u;
    return a->lingering_ms >= QUICK_STOP_MS || a->stopping_ms >= (uint32_t)a->params.stop_max_ms;
}

static void step_quick_stop(struct axis *a)
{
    modes_control_speed(a,
                        (int32_t)q15_clamp(a->tuning.ramp_q16, 1, INT32_MAX / QUICK_STOP_FACTOR) * QUICK_STOP_FACTOR);
    const bool stands = a->speed.ref_rpm_q16 == 0 && q15_abs(a->speed.speed_rpm_q4) < AXIS_STANDSTILL_RPM_Q4;
    if (stop_takes_too_long(a) || stands) {
        bridge_off(a);
        enter(a, AXIS_SWITCH_ON_DISABLED);
    }
}

static void begin_quick_stop(struct axis *a)
{
    modes_enter(a, AXIS_MODE_SPEED);
    a->speed.target_rpm_q16 = 0;
    a->stopping_ms = 0;
    a->lingering_ms = 0;
    enter(a, AXIS_QUICK_STOP);
}

static void switch_off(struct axis *a)
{
    bridge_off(a);
    identify_stop(&a->identify, FAULT_NONE);
    enter(a, AXIS_SWITCH_ON_DISABLED);
}

/* Before operation no speed loop runs that could brake. */
static void take_quick_stop(struct axis *a)
{
    if (a->state == AXIS_OPERATION_ENABLED) {
        begin_quick_stop(a);
    } else if (a->state == AXIS_READY || a->state == AXIS_SWITCHED_ON) {
        switch_off(a);
    }
}

static void make_ready(struct axis *a)
{
    if (!pwm_set_update(&a->fabric->pwm, a->tuning.update) ||
        !pwm_set_samples(&a->fabric->pwm, (uint32_t)a->tuning.samples, (uint32_t)a->tuning.early_counts) ||
        !adc_select(&a->fabric->adc, (uint32_t)a->tuning.modulator_osr, a->tuning.modulator_trip_q15,
                    a->tuning.settle_counts)) {
        axis_raise(a, FAULT_FABRIC);
        return;
    }
    a->paced_ms = a->loop.loops_per_slow == a->tuning.loops_per_slow ? a->paced_ms : a->time_ms;
    current_loop_tune(&a->loop, &a->tuning);
    gate_set_chopper(&a->fabric->gate, a->tuning.chopper_on_q15, a->tuning.chopper_off_q15);
    reaction_begin(&a->reactions);
    carry_begin(a);
    handover_forget(&a->handover);
    enter(a, AXIS_READY);
}

/*
 * Requests were checked when made, against a state that still holds unless a fault or the end of a stop has come in between:
 * then the state no longer allows them, and they are dropped.
 */
static __attribute__((noinline)) void take_request(struct axis *a)
{
    const uint32_t wanted = a->request;
    a->request = AXIS_REQUEST_NONE;
    switch (wanted) {
    case AXIS_REQUEST_ON:
    case AXIS_REQUEST_IDENTIFY:
    case AXIS_REQUEST_LEARN_HALL:
        if (a->state == AXIS_SWITCH_ON_DISABLED) {
            a->start.learns = wanted == AXIS_REQUEST_LEARN_HALL;
            make_ready(a);
        }
        break;
    case AXIS_REQUEST_OFF:
        if (a->state != AXIS_FAULT && a->state != AXIS_FAULT_REACTION) {
            switch_off(a);
        }
        break;
    case AXIS_REQUEST_QUICK_STOP:
        take_quick_stop(a);
        break;
    case AXIS_REQUEST_CLEAR:
        if (a->state == AXIS_FAULT) {
            fault_forget(a);
            enter(a, AXIS_SWITCH_ON_DISABLED);
        }
        break;
    case AXIS_REQUEST_SOURCE:
        if (a->state == AXIS_OPERATION_ENABLED) {
            handover_take(a);
        }
        break;
    default:
        break;
    }
}

/* Expect the conversions of a millisecond, +-1, since the last step; the fabric detects unread ones. */
static void watch_heartbeat(struct axis *a)
{
    const uint32_t conversions = adc_sequence(&a->fabric->adc);
    const uint32_t too_many = conversions - a->heartbeat - (uint32_t)a->loop.loops_per_slow;
    a->heartbeat = conversions;
    if (SELDOM(too_many + 1u > 2u) && a->time_ms - a->paced_ms > LOOP_START_MS) { /* once in 49.7 days for less time */
        axis_raise(a, FAULT_LOOP_STOPPED);
    }
}

/*
 * The current loop checks the latches while the bridge is on. If one is found here, the bridge is off, or conversions go
 * unanswered because the current loop's interrupt has stopped.
 */
static void watch_latches(struct axis *a)
{
    const uint32_t status = gate_status(&a->fabric->gate);
    if (USUALLY((status & (GATE_STATUS_LATCHES | GATE_STATUS_LIVE)) == GATE_STATUS_LIVE) ||
        a->faults.cause != FAULT_NONE) {
        return;
    }
    if ((status & GATE_STATUS_LATCHES) != 0u) {
        const enum fault cause = fault_from_gate(status);
        axis_raise(a, cause == FAULT_LOOP_OVERRUN ? FAULT_LOOP_STOPPED : cause);
    } else if (current_loop_is_on(&a->loop)) {
        axis_raise(a, FAULT_GATES_OFF);
    }
}

/* The encoder's count no longer matches the alignment. */
static bool spoils_alignment(uint32_t cause)
{
    return cause == FAULT_ENCODER || cause == FAULT_ENCODER_SLIP || cause == FAULT_ENCODER_DEAD ||
           cause == FAULT_ENCODER_COUNTS;
}

static __attribute__((noinline)) void react_to_fault(struct axis *a)
{
    bridge_off(a);
    identify_stop(&a->identify, a->faults.cause);
    a->request = AXIS_REQUEST_NONE;
    a->reactions.stopping = false;
    a->carry.waits = FAULT_NONE;
    if (spoils_alignment(a->faults.cause)) {
        a->start.aligned = false; /* and the index must be seen again */
        encoder_clear(&a->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
    }
    enter(a, AXIS_FAULT_REACTION);
}

static void leave_start(struct axis *a)
{
    if (!a->identify.running && !a->start.learns) {
        begin_operation(a);
        return;
    }
    switch_off(a);
}

static __attribute__((noinline)) void step_other_state(struct axis *a)
{
    switch (a->state) {
    case AXIS_READY:
        start_begin(a);
        enter(a, AXIS_SWITCHED_ON);
        break;
    case AXIS_SWITCHED_ON:
        if (start_step(a)) {
            leave_start(a);
        }
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

static void step_state(struct axis *a)
{
    if (USUALLY(a->state == AXIS_OPERATION_ENABLED)) {
        modes_step_here(a);
    } else {
        step_other_state(a);
    }
}

/* When the clock wraps, both words change at once: the current loop may come in between and read them. */
static void count_time(struct axis *a)
{
    const uint32_t now_ms = a->time_ms + 1u;
    if (USUALLY(now_ms != 0u)) {
        a->time_ms = now_ms;
        return;
    }
    const uint32_t mask = cpu_irq_save();
    a->time_ms = 0;
    a->time_wraps++;
    cpu_irq_restore(mask);
}

/* A fault whose reaction is a controlled stop: valid as long as nothing else has switched the bridge off. */
static bool stops_under_control(struct axis *a)
{
    if (!a->reactions.stopping || !is_running(a) || (gate_status(&a->fabric->gate) & GATE_STATUS_LIVE) == 0u) {
        return false;
    }
    if (a->state == AXIS_OPERATION_ENABLED) {
        begin_quick_stop(a);
    }
    return true;
}

/* A fault, a request, an encoder that the interrupt has given up; true if the state has nothing more to do in this step. */
static __attribute__((noinline)) bool reacts(struct axis *a)
{
    if (a->carry.waits != FAULT_NONE && a->faults.cause == FAULT_NONE) {
        carry_step(a);
    }
    if (a->faults.cause != FAULT_NONE && a->state != AXIS_FAULT && a->state != AXIS_FAULT_REACTION &&
        !stops_under_control(a)) {
        react_to_fault(a);
        return true;
    }
    if (a->request != AXIS_REQUEST_NONE) {
        take_request(a);
    }
    return false;
}

static void step_torque_limits(struct axis *a)
{
    if (a->time_ms % LIMITS_MS == 0u) {
        torque_measure(&a->torque, &a->loop, &a->tuning, adc_vbus_q15(&a->fabric->adc));
        if (USUALLY(is_running(a))) {
            modes_limit_torque_here(a);
        }
    } else if (SELDOM(torque_flux_is_near(&a->torque, &a->tuning))) {
        torque_follow_flux(&a->torque, &a->loop, &a->tuning, adc_vbus_q15(&a->fabric->adc));
    }
}

static void step_thermal(struct axis *a)
{
    if (SELDOM(thermal_sample(&a->thermal, &a->loop))) {
        thermal_update(&a->thermal, adc_temperature_code(&a->fabric->adc));
    }
}

void axis_step(struct axis *a)
{
    count_time(a);
    if (SELDOM(axis_fabric_doubted(a))) {
        return;
    }
    rotor_measure(a);
    turns_follow(&a->motion.turns, a->speed.estimate.moved, a->speed.estimate.count);
    step_torque_limits(a);
    watch_heartbeat(a);
    watch_latches(a);
    if (USUALLY((a->faults.cause | a->request | a->carry.waits) == 0u) || !reacts(a)) {
        step_state(a);
    }
    if (a->time_ms % THERMAL_STEP_MS == THERMAL_TURN) {
        step_thermal(a);
        if (a->start.aligned && !a->start.index_known) {
            start_learn_index(a);
        }
    }
    const uint32_t state = a->state;
    const struct tuning *const t = SELDOM(state == AXIS_SWITCHED_ON) ? start_tuning(a) : &a->tuning;
    current_loop_follow(&a->loop, a->fabric, t);
    if (USUALLY(rotor_has_encoder(a))) {
        supervision_step_here(a, state, true, current_loop_w_q15(&a->loop));
    } else {
        sensorless_follow(a);
        supervision_step(a);
    }
}

void axis_init(struct axis *a, struct fabric *fabric)
{
    *a = (struct axis){.fabric = fabric, .fabric_doubt = AXIS_FABRIC_DOUBTED};
    current_loop_init(&a->loop);
    speed_loop_init(&a->speed);
    params_init(&a->params);
    (void)tuning_compute(&a->params, &a->tuning); /* the initial values fit: a test says so */
    current_loop_tune(&a->loop, &a->tuning);
    thermal_init(&a->thermal, NULL, &a->params);
    reaction_init(&a->reactions);
    speed_loop_tune(&a->speed, &a->tuning);
}

void axis_remember_heat(struct axis *a, struct thermal_memory *memory)
{
    thermal_init(&a->thermal, memory, &a->params);
}

static const struct pwm_setup pwm_setup = {
    .half_counts = CONFIG_HALF_COUNTS,
    .dead_counts = CONFIG_DEAD_COUNTS,
    .min_pulse_counts = CONFIG_MIN_PULSE_COUNTS,
    .update = PWM_UPDATE_VALLEY,
};

static bool start_fabric(struct axis *a)
{
    (void)encoder_init(&a->fabric->encoder, (uint32_t)a->params.encoder_counts, false);
    const bool running = pwm_init(&a->fabric->pwm, &pwm_setup);
    adc_start(&a->fabric->adc);
    return running;
}

/* The fabric's state is unknown: it is not touched from here on. Its gates have been off since the reset. */
static void doubt_fabric(struct axis *a, enum fault cause)
{
    a->fabric_doubt = AXIS_FABRIC_DOUBTED;
    axis_raise(a, cause);
    enter(a, AXIS_FAULT);
}

void axis_start(struct axis *a, enum fault boot_fault)
{
    if (fault_doubts_fabric(boot_fault)) {
        doubt_fabric(a, boot_fault);
        return;
    }
    if (!start_fabric(a)) {
        doubt_fabric(a, FAULT_FABRIC);
        return;
    }
    a->fabric_doubt = 0;
    enter(a, AXIS_SWITCH_ON_DISABLED);
    if (boot_fault != FAULT_NONE) {
        axis_raise(a, boot_fault);
    }
}
