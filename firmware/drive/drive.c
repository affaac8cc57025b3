/* SPDX-License-Identifier: MIT */
/* A millisecond of the drive, in its order: measure, limits, states, control, monitors, reactions. */
#include "firmware/drive/drive.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/reset.h"
#include "firmware/drive/requests.h"
#include "firmware/drive/states.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"

#define LOOP_START_MS 2u /* for the PWM's first periods to pass, or the first with another number of samples */
#define LIMITS_MS     2u /* torque.h: every second slow period */
#define THERMAL_TURN  3u /* of THERMAL_STEP_MS */

/* When the clock wraps, both words change at once: the current loop may come in between and read them. */
static void count_time(struct axis *a)
{
    const uint32_t now_ms = a->time_ms + 1u;
    if (now_ms != 0u) {
        a->time_ms = now_ms;
        return;
    }
    const uint32_t mask = cpu_irq_save();
    a->time_ms = 0;
    a->time_wraps++;
    cpu_irq_restore(mask);
}

/* While the other axis identifies, this one's step waits for its bursts (pulses.h): up to half a millisecond. */
static bool may_be_late(struct axis *a)
{
    if (a->beside != NULL && a->beside->identify.running) {
        a->beside_identified_ms = a->time_ms;
    }
    return a->beside != NULL && a->time_ms - a->beside_identified_ms <= LOOP_START_MS;
}

/* Expect the conversions of a millisecond, +-1, since the last step; the fabric detects unread ones. */
static void watch_heartbeat(struct axis *a)
{
    const uint32_t conversions = adc_sequence(&a->fabric->adc);
    const uint32_t too_many = conversions - a->heartbeat - (uint32_t)a->loop.loops_per_slow;
    const uint32_t most = may_be_late(a) ? (uint32_t)a->loop.loops_per_slow / 2u : 1u;
    a->heartbeat = conversions;
    if (too_many + most > 2u * most &&
        a->time_ms - a->pace_chosen_ms > LOOP_START_MS) { /* once in 49.7 days for less time */
        fault_raise(a, FAULT_LOOP_STOPPED);
    }
}

/*
 * The current loop checks the latches while the bridge is on. If one is found here, the bridge is off, or conversions go
 * unanswered because the current loop's interrupt has stopped. That one input of safe torque off stopped the drive, and the
 * other has not followed since, is what the first cause turns out to be.
 */
static void watch_latches(struct axis *a)
{
    const uint32_t status = gate_status(&a->fabric->gate);
    if ((status & GATE_STATUS_STO_APART) != 0u && (a->faults.cause == FAULT_STO_A || a->faults.cause == FAULT_STO_B)) {
        fault_turns_out(a, FAULT_STO_APART);
    }
    if ((status & (GATE_STATUS_LATCHES | GATE_STATUS_LIVE)) == GATE_STATUS_LIVE || a->faults.cause != FAULT_NONE) {
        return;
    }
    if ((status & GATE_STATUS_LATCHES) != 0u) {
        const enum fault cause = fault_from_gate(status);
        fault_raise(a, cause == FAULT_LOOP_OVERRUN ? FAULT_LOOP_STOPPED : cause);
    } else if (current_loop_is_on(&a->loop)) {
        fault_raise(a, FAULT_GATES_OFF);
    }
}

static void step_torque_limits(struct axis *a)
{
    if (a->time_ms % LIMITS_MS == 0u) {
        torque_measure(&a->torque, &a->loop, &a->tuning, adc_vbus_q15(&a->fabric->adc));
        if (states_are_running(a)) {
            modes_limit_torque(a);
        }
    } else if (torque_flux_is_near(&a->torque, &a->tuning)) {
        torque_follow_flux(&a->torque, &a->loop, &a->tuning, adc_vbus_q15(&a->fabric->adc));
    }
}

static void step_thermal(struct axis *a)
{
    if (thermal_sample(&a->thermal, &a->loop)) {
        thermal_update(&a->thermal, adc_temperature_code(&a->fabric->adc));
        fault_warn_while(a, FAULT_TEMPERATURE_SENSOR, thermal_sensor_fails(&a->thermal));
    }
}

void drive_step(struct axis *a)
{
    count_time(a);
    if (axis_fabric_doubted(a)) {
        return;
    }
    start_source_before(a);
    turns_follow(&a->motion.turns, a->speed.estimate.moved, a->speed.estimate.count);
    step_torque_limits(a);
    watch_heartbeat(a);
    watch_latches(a);
    states_step(a);
    if (a->time_ms % THERMAL_STEP_MS == THERMAL_TURN) {
        step_thermal(a);
        start_learn_index(a);
    }
    current_loop_follow(&a->loop, a->fabric, a->state == AXIS_SWITCHED_ON ? start_tuning(a) : &a->tuning);
    start_source_after(a);
    supervision_step(a);
    reaction_step(a);
    gate_prove(&a->fabric->gate);
}

/* ==== what is shown ==== */

/* What a running axis shows to others. */

static int64_t target(const struct axis *a)
{
    return a->mode == AXIS_MODE_CYCLIC_POSITION ? a->motion.cyclic.target : a->motion.profile.target;
}

static struct drive_status status_look(const struct axis *a)
{
    const volatile struct current_loop *const loop = &a->loop;
    const int32_t forward = axis_forward(a);
    return (struct drive_status){
        .state = a->state,
        .fault = a->faults.cause,
        .speed_rpm_q4 = forward * a->speed.speed_rpm_q4,
        .speed_ref_rpm_q4 = forward * a->speed.speed_ref_rpm_q4,
        .up_ms = axis_up_ms(a),
        .mode = a->mode,
        .homed = a->motion.homed,
        .position = (int32_t)(forward * a->motion.turns.counts),
        .target = (int32_t)(forward * position_counts(target(a), &a->tuning)),
        .error_counts = forward * a->motion.position.error_counts,
        .i_d_q15 = loop->i_d_q15,
        .i_q_q15 = forward * loop->i_q_q15,
        .i_d_ref_q15 = loop->i_d_ref_q15,
        .i_q_ref_q15 = forward * loop->i_q_ref_q15,
        .vbus_q15 = loop->vbus_q15,
    };
}

/* Changes with each sample; a fabric in doubt is not sampled. */
static uint32_t sample(const struct axis *a)
{
    return axis_fabric_doubted(a) ? 0u : adc_sequence(&a->fabric->adc);
}

/* The slow loop is held off, the current loop is not: what it interrupts is read again. */
struct drive_status drive_status(const struct axis *a)
{
    struct drive_status status;
    uint32_t before;
    const uint32_t held = request_hold();
    do {
        before = sample(a);
        status = status_look(a);
    } while (sample(a) != before);
    request_release(held);
    return status;
}

/* ==== before the slow loop runs ==== */

/* The drive before its slow loop runs. Thread. */

void drive_init(struct axis *a, struct fabric *fabric)
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

void drive_remember_heat(struct axis *a, struct thermal_memory *memory)
{
    thermal_init(&a->thermal, memory, &a->params);
}

void drive_join(struct axis *a, struct axis *follower)
{
    a->beside = follower;
    follower->beside = a;
    follower->carrier_ahead_counts = CONFIG_HALF_COUNTS / 2u;
}

static struct pwm_setup pwm_setup(const struct axis *a)
{
    return (struct pwm_setup){
        .half_counts = CONFIG_HALF_COUNTS,
        .dead_counts = CONFIG_DEAD_COUNTS,
        .min_pulse_counts = CONFIG_MIN_PULSE_COUNTS,
        .update = PWM_UPDATE_VALLEY,
        .ahead_counts = a->carrier_ahead_counts,
    };
}

/* A warm start finds what a cold one does, even where the fabric was not reset with the core: a debugger's start. */
static bool start_fabric(struct axis *a)
{
    fabric_reset(a->fabric);
    (void)encoder_init(&a->fabric->encoder, (uint32_t)a->params.encoder_counts, false);
    const struct pwm_setup setup = pwm_setup(a);
    const bool running = pwm_init(&a->fabric->pwm, &setup);
    adc_start(&a->fabric->adc);
    return gate_start_watch(&a->fabric->gate, CONFIG_WATCH_CLOCKS) && running;
}

/* The fabric's state is unknown: it is not touched from here on. Its gates have been off since the reset. */
static void doubt_fabric(struct axis *a, enum fault cause)
{
    a->fabric_doubt = AXIS_FABRIC_DOUBTED;
    fault_raise(a, cause);
    (void)states_take(a, DRIVE_EVENT_DOUBTED);
}

void drive_start(struct axis *a, enum fault boot_fault)
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
    (void)states_take(a, DRIVE_EVENT_BOOTED);
    if (boot_fault != FAULT_NONE) {
        fault_raise(a, boot_fault);
    }
}
