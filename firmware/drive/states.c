/* SPDX-License-Identifier: MIT */
#include "firmware/drive/states.h"

#include <stddef.h>

#include "firmware/axis/axis.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/retune.h"
#include "firmware/settings/features.h"
#include "lib/q15.h"

#define QUICK_STOP_MS     5000u
#define QUICK_STOP_FACTOR 4 /* times the normal ramp */

bool states_are_running(const struct axis *a)
{
    const uint32_t state = a->state;
    return state == AXIS_OPERATION_ENABLED || state == AXIS_QUICK_STOP;
}

/* ---- guards and actions ---- */

/* Writes the settings to the fabric; a failure latches a fault. */
static void set_fabric(struct axis *a)
{
    struct fabric *const f = a->fabric;
    const struct tuning *const t = &a->tuning;
    const bool accepts = pwm_set_update(&f->pwm, t->update) &&
                         pwm_set_samples(&f->pwm, (uint32_t)t->samples, (uint32_t)t->early_counts) &&
                         adc_select(&f->adc, (uint32_t)t->modulator_osr, t->modulator_trip_q15, t->settle_counts);
    if (!accepts) {
        fault_raise(a, FAULT_FABRIC);
    }
    gate_set_chopper(&f->gate, t->chopper_on_q15, t->chopper_off_q15);
}

static void make_ready_with(struct axis *a, const struct tuning *t)
{
    apply_tuning(a, t);
    set_fabric(a);
    a->rate_chosen_ms = a->time_ms; /* the carrier may have stopped, or its rate changed */
    current_loop_tune(&a->loop, &a->tuning);
    fault_clear_warnings(&a->reports);
    a->reactions.gain_reductions = 0;
    failover_reset(a);
    handover_forget(&a->handover);
    a->start.learns = false;
    a->speed.target_rpm_q16 = a->retry.start_rpm_q16; /* a retry after a fault in this start uses this target */
}

static void make_ready(struct axis *a)
{
    make_ready_with(a, &a->switching.tuning);
}

static void make_ready_to_learn(struct axis *a)
{
    make_ready(a);
    a->start.learns = true;
}

/* Discards what is known of the encoder. */
static void make_ready_to_identify(struct axis *a)
{
    start_forget(a);
    make_ready_with(a, &a->identify.tuning);
}

static void end_identify(struct axis *a, uint32_t fault)
{
    if (FEATURE_IN(IDENTIFY)) {
        identify_stop(&a->identify, fault);
    }
}

static void bridge_off(struct axis *a)
{
    current_loop_off(&a->loop, a->fabric);
    torque_reset(&a->torque);
}

static void switch_off(struct axis *a)
{
    bridge_off(a);
    end_identify(a, FAULT_NONE);
}

static void change_source(struct axis *a)
{
    if (FEATURE_SOURCES > 1) {
        handover_take(a);
    }
}

static bool start_was_for_operation(struct axis *a)
{
    return !a->identify.running && !a->start.learns;
}

static void begin_operation(struct axis *a)
{
    speed_loop_reset(&a->speed, 0);
    speed_loop_allow_less(&a->speed, a->reactions.choice[FAULT_OSCILLATION] == REACTION_CARRY);
    a->mode = AXIS_MODE_SPEED;
    a->set_point.waits = false; /* of an earlier operation */
    a->speed.target_rpm_q16 = a->retry.start_rpm_q16;
    modes_limit_torque(a);
    supervision_begin(a);
}

static void begin_quick_stop(struct axis *a)
{
    modes_enter(a, AXIS_MODE_SPEED);
    a->speed.target_rpm_q16 = 0;
    a->stopping_ms = 0;
    a->unlimited_braking_ms = 0;
}

/* Drops pending requests and set-points. */
static void react_to_fault(struct axis *a)
{
    bridge_off(a);
    end_identify(a, a->faults.cause);
    a->request = AXIS_REQUEST_NONE;
    a->reactions.stopping = false;
    a->failover.pending = FAULT_NONE;
    start_forget_after(a, (enum fault)a->faults.cause);
}

static bool fault_is_latched(struct axis *a)
{
    return a->faults.cause != FAULT_NONE;
}

/* ---- the table ---- */

#define IN(state) (1u << AXIS_##state)
#define BRIDGE_ON (IN(SWITCHED_ON) | IN(OPERATION_ENABLED) | IN(QUICK_STOP))

struct transition {
    uint16_t from; /* one bit per enum axis_state */
    uint8_t event; /* enum drive_event */
    uint8_t to;    /* enum axis_state */
    bool (*guard)(struct axis *a);
    void (*action)(struct axis *a);
};

/* The first matching row applies. tests/tools/states_page.py reads one row a line for docs/states.md. */
static const struct transition transition_table[] = {
    {IN(NOT_READY), DRIVE_EVENT_BOOTED, AXIS_SWITCH_ON_DISABLED, NULL, NULL},
    {IN(NOT_READY), DRIVE_EVENT_UNTRUSTED, AXIS_FAULT, NULL, NULL},
    {IN(SWITCH_ON_DISABLED), DRIVE_EVENT_ON, AXIS_READY, NULL, make_ready},
    {IN(SWITCH_ON_DISABLED), DRIVE_EVENT_IDENTIFY, AXIS_READY, NULL, make_ready_to_identify},
    {IN(SWITCH_ON_DISABLED), DRIVE_EVENT_LEARN_HALL, AXIS_READY, NULL, make_ready_to_learn},
    {IN(READY), DRIVE_EVENT_STARTING, AXIS_SWITCHED_ON, NULL, start_begin},
    {IN(SWITCHED_ON), DRIVE_EVENT_STARTED, AXIS_OPERATION_ENABLED, start_was_for_operation, begin_operation},
    {IN(SWITCHED_ON), DRIVE_EVENT_STARTED, AXIS_SWITCH_ON_DISABLED, NULL, switch_off},
    {IN(OPERATION_ENABLED), DRIVE_EVENT_SOURCE, AXIS_OPERATION_ENABLED, NULL, change_source},
    {IN(OPERATION_ENABLED), DRIVE_EVENT_QUICK_STOP, AXIS_QUICK_STOP, NULL, begin_quick_stop},
    {IN(READY) | IN(SWITCHED_ON), DRIVE_EVENT_QUICK_STOP, AXIS_SWITCH_ON_DISABLED, NULL, switch_off},
    {IN(OPERATION_ENABLED), DRIVE_EVENT_FAULT_STOP, AXIS_QUICK_STOP, NULL, begin_quick_stop},
    {IN(QUICK_STOP), DRIVE_EVENT_STOPPED, AXIS_FAULT_REACTION, fault_is_latched, react_to_fault},
    {IN(QUICK_STOP), DRIVE_EVENT_STOPPED, AXIS_SWITCH_ON_DISABLED, NULL, bridge_off},
    {IN(SWITCH_ON_DISABLED) | IN(READY) | BRIDGE_ON, DRIVE_EVENT_OFF, AXIS_SWITCH_ON_DISABLED, NULL, switch_off},
    {IN(SWITCH_ON_DISABLED) | IN(READY) | BRIDGE_ON, DRIVE_EVENT_FAULT, AXIS_FAULT_REACTION, NULL, react_to_fault},
    {IN(FAULT_REACTION), DRIVE_EVENT_GATES_SHUT, AXIS_FAULT, NULL, NULL},
    {IN(FAULT), DRIVE_EVENT_CLEAR, AXIS_SWITCH_ON_DISABLED, NULL, fault_clear},
};

static bool states_fits(const struct transition *t, struct axis *a, enum drive_event event)
{
    return t->event == event && ((t->from >> a->state) & 1u) != 0u && (t->guard == NULL || t->guard(a));
}

bool states_take(struct axis *a, enum drive_event event)
{
    for (uint32_t n = 0; n < sizeof transition_table / sizeof transition_table[0]; n++) {
        const struct transition *const t = &transition_table[n];
        if (states_fits(t, a, event)) {
            if (t->action != NULL) {
                t->action(a);
            }
            a->state = t->to;
            return true;
        }
    }
    return false;
}

/* ---- a millisecond in a state; returns the event it ends in ---- */

static enum drive_event in_ready(struct axis *a)
{
    (void)a;
    return DRIVE_EVENT_STARTING;
}

static enum drive_event in_start(struct axis *a)
{
    return start_step(a) ? DRIVE_EVENT_STARTED : DRIVE_EVENT_NONE;
}

static enum drive_event in_operation(struct axis *a)
{
    modes_step(a);
    return DRIVE_EVENT_NONE;
}

/* Time at the braking limit does not count: the stop then takes as long as the limits require. */
static bool stop_takes_too_long(struct axis *a)
{
    a->stopping_ms++;
    a->unlimited_braking_ms += a->speed.at_limit ? 0u : 1u;
    return a->unlimited_braking_ms >= QUICK_STOP_MS || a->stopping_ms >= (uint32_t)a->params.stop_max_ms;
}

static enum drive_event in_quick_stop(struct axis *a)
{
    modes_control_speed(a,
                        (int32_t)q15_clamp(a->tuning.ramp_q16, 1, INT32_MAX / QUICK_STOP_FACTOR) * QUICK_STOP_FACTOR);
    const bool stands = a->speed.ref_rpm_q16 == 0 && q15_abs(a->speed.speed_rpm_q4) < AXIS_STANDSTILL_RPM_Q4;
    return stop_takes_too_long(a) || stands ? DRIVE_EVENT_STOPPED : DRIVE_EVENT_NONE;
}

static enum drive_event in_fault_reaction(struct axis *a)
{
    const bool live = (gate_status(&a->fabric->gate) & GATE_STATUS_LIVE) != 0u;
    return live ? DRIVE_EVENT_NONE : DRIVE_EVENT_GATES_SHUT;
}

static enum drive_event (*const state_steps[])(struct axis *a) = {
    [AXIS_READY] = in_ready,
    [AXIS_SWITCHED_ON] = in_start,
    [AXIS_OPERATION_ENABLED] = in_operation,
    [AXIS_QUICK_STOP] = in_quick_stop,
    [AXIS_FAULT_REACTION] = in_fault_reaction,
    [AXIS_FAULT] = NULL,
};

static void step_state(struct axis *a)
{
    enum drive_event (*const step)(struct axis *) = state_steps[a->state];
    const enum drive_event event = step == NULL ? DRIVE_EVENT_NONE : step(a);
    if (event != DRIVE_EVENT_NONE) {
        (void)states_take(a, event);
    }
}

/* ---- a fault, a request ---- */

/* A controlled stop continues unless the bridge is off or `off` is requested. */
static bool stops_under_control(const struct axis *a)
{
    return a->reactions.stopping && states_are_running(a) && a->request != AXIS_REQUEST_OFF &&
           (gate_status(&a->fabric->gate) & GATE_STATUS_LIVE) != 0u;
}

/* True if it has switched the bridge off: the step ends. */
static bool take_fault(struct axis *a)
{
    if (stops_under_control(a)) {
        (void)states_take(a, DRIVE_EVENT_FAULT_STOP);
        return false;
    }
    return states_take(a, DRIVE_EVENT_FAULT);
}

static void take_request(struct axis *a)
{
    static const uint8_t event_of[] = {
        [AXIS_REQUEST_ON] = DRIVE_EVENT_ON,
        [AXIS_REQUEST_OFF] = DRIVE_EVENT_OFF,
        [AXIS_REQUEST_QUICK_STOP] = DRIVE_EVENT_QUICK_STOP,
        [AXIS_REQUEST_CLEAR] = DRIVE_EVENT_CLEAR,
        [AXIS_REQUEST_IDENTIFY] = DRIVE_EVENT_IDENTIFY,
        [AXIS_REQUEST_LEARN_HALL] = DRIVE_EVENT_LEARN_HALL,
        [AXIS_REQUEST_SOURCE] = DRIVE_EVENT_SOURCE,
    };
    const uint32_t request = a->request;
    a->request = AXIS_REQUEST_NONE;
    (void)states_take(a, (enum drive_event)event_of[request]);
}

void states_step(struct axis *a)
{
    if (FEATURE_IN(SENSORLESS) && a->failover.pending != FAULT_NONE && a->faults.cause == FAULT_NONE) {
        failover_step(a);
    }
    if (a->faults.cause != FAULT_NONE && take_fault(a)) {
        return;
    }
    if (a->request != AXIS_REQUEST_NONE) {
        take_request(a);
    }
    if (a->state == AXIS_OPERATION_ENABLED) {
        set_point_take(a);
    }
    step_state(a);
}
