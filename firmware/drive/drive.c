/* SPDX-License-Identifier: MIT */
/* The drive's slow loop, in this order: measure, limits, states, control, monitors, reactions. */
#include "firmware/drive/drive.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/reset.h"
#include "firmware/drive/requests.h"
#include "firmware/drive/states.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"

#define LOOP_START_MS 2u /* for the first PWM periods, also after a change of samples per period */
#define LIMITS_MS     2u /* every second step (torque.h) */
#define THERMAL_TURN  3u /* of THERMAL_STEP_MS */

/* Masked: the current loop must not read one word of the clock before the overflow and the other after it. */
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

/* While the other axis identifies, its bursts (pulses.h) delay this step by up to half a millisecond. */
static bool may_be_late(struct axis *a)
{
    if (a->other_axis != NULL && a->other_axis->identify.running) {
        a->other_identified_ms = a->time_ms;
    }
    return a->other_axis != NULL && a->time_ms - a->other_identified_ms <= LOOP_START_MS;
}

/* A step must see the conversions of a millisecond, +-1; the fabric detects those that were not read. */
static void watch_heartbeat(struct axis *a)
{
    const uint32_t conversions = adc_sequence(&a->fabric->adc);
    const uint32_t too_many = conversions - a->heartbeat - (uint32_t)a->loop.loops_per_slow;
    const uint32_t most = may_be_late(a) ? (uint32_t)a->loop.loops_per_slow / 2u : 1u;
    a->heartbeat = conversions;
    if (too_many + most > 2u * most &&
        a->time_ms - a->rate_chosen_ms > LOOP_START_MS) { /* when time_ms overflows, for less time */
        fault_raise(a, FAULT_LOOP_STOPPED);
    }
}

/*
 * The current loop checks the latches while the bridge is on. A latch found here means that the bridge is off or that the
 * current loop's interrupt has stopped. If one input of safe torque off has stopped the drive and the other has not followed,
 * the fault's cause becomes that.
 */
static void watch_latches(struct axis *a)
{
    const uint32_t status = gate_status(&a->fabric->gate);
    if ((status & GATE_STATUS_STO_APART) != 0u && (a->faults.cause == FAULT_STO_A || a->faults.cause == FAULT_STO_B)) {
        fault_correct_cause(a, FAULT_STO_APART);
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
    if (axis_fabric_is_untrusted(a)) {
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

/* ==== status ==== */

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

/* Changes with each sample; constant if the fabric is not trusted. */
static uint32_t sample(const struct axis *a)
{
    return axis_fabric_is_untrusted(a) ? 0u : adc_sequence(&a->fabric->adc);
}

/* The slow loop is masked; the current loop is not: if a sample came in between, everything is read again. */
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

/* ==== start-up ==== */

/* Before the slow loop runs. Thread. */

void drive_init(struct axis *a, struct fabric *fabric)
{
    *a = (struct axis){.fabric = fabric, .fabric_untrusted = AXIS_FABRIC_UNTRUSTED};
    current_loop_init(&a->loop);
    speed_loop_init(&a->speed);
    params_init(&a->params);
    (void)tuning_compute(&a->params, &a->tuning); /* a test checks that the initial values are consistent */
    current_loop_tune(&a->loop, &a->tuning);
    thermal_init(&a->thermal, NULL, &a->params);
    reaction_init(&a->reactions);
    speed_loop_tune(&a->speed, &a->tuning);
}

void drive_restore_temperatures(struct axis *a, struct thermal_memory *memory)
{
    thermal_init(&a->thermal, memory, &a->params);
}

void drive_link(struct axis *a, struct axis *follower)
{
    a->other_axis = follower;
    follower->other_axis = a;
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

/* Resets the fabric, because a debugger may restart the core without it. */
static bool start_fabric(struct axis *a)
{
    fabric_reset(a->fabric);
    (void)encoder_init(&a->fabric->encoder, (uint32_t)a->params.encoder_counts, false);
    const struct pwm_setup setup = pwm_setup(a);
    const bool running = pwm_init(&a->fabric->pwm, &setup);
    adc_start(&a->fabric->adc);
    return gate_start_watch(&a->fabric->gate, CONFIG_WATCH_CLOCKS) && running;
}

/* The fabric's state is unknown: its registers are not accessed from now on. Reset has left the gates off. */
static void distrust_fabric(struct axis *a, enum fault cause)
{
    a->fabric_untrusted = AXIS_FABRIC_UNTRUSTED;
    fault_raise(a, cause);
    (void)states_take(a, DRIVE_EVENT_UNTRUSTED);
}

void drive_start(struct axis *a, enum fault boot_fault)
{
    if (fault_fabric_is_untrusted(boot_fault)) {
        distrust_fabric(a, boot_fault);
        return;
    }
    if (!start_fabric(a)) {
        distrust_fabric(a, FAULT_FABRIC);
        return;
    }
    a->fabric_untrusted = 0;
    (void)states_take(a, DRIVE_EVENT_BOOTED);
    if (boot_fault != FAULT_NONE) {
        fault_raise(a, boot_fault);
    }
}
