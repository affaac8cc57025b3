/* SPDX-License-Identifier: MIT */
#include "firmware/axis/axis.h"
#include "firmware/drive/start.h"
#include "firmware/source/rotor.h"

static void sensorless_begin_start(struct axis *a)
{
    a->start.suspected = FAULT_NONE; /* the rotor's motion is not known yet */
}

static void sensorless_calibrated(struct axis *a)
{
    injection_reset(&a->loop, &a->tuning); /* of the last start */
    flying_begin(a);
    a->start.phase = START_CATCH;
}

/* Switches off and checks the EMF: the currents of a driven rotor resemble wrong wiring. */
static void sensorless_wiring_failed(struct axis *a, enum fault fault)
{
    current_loop_off(&a->loop, a->fabric);
    flying_begin(a);
    a->start.suspected = fault;
    a->start.phase = START_CHECK_TURNING;
}

/* Injection is calibrated at rest; without it a reluctance rotor cannot be controlled at standstill. */
static bool may_lead(struct axis *a)
{
    if (a->tuning.reluctant) {
        const int64_t mturn_s = (int64_t)q15_abs(a->speed.speed_rpm_q4) * 1000 / (60 * 16);
        const int64_t counts = mturn_s * a->tuning.encoder_counts * CALIBRATION_MS / 1000000;
        fault_raise_with(a, FAULT_ROTOR_TURNING, (int32_t)counts, a->tuning.encoder_counts);
    }
    return !a->tuning.reluctant;
}

/* True when the rotor is caught turning. */
static bool step_catch(struct axis *a)
{
    const enum flying_result result = flying_step(a);
    if (result == FLYING_STANDS) {
        start_open_gates(a);
    }
    return result == FLYING_CAUGHT && may_lead(a);
}

static void step_check_turning(struct axis *a)
{
    const enum flying_result result = flying_step(a);
    if (result == FLYING_CAUGHT) {
        fault_raise_with(a, FAULT_LOAD_TOO_HIGH, ALIGNMENT_OUT_DEGREES, 0);
    } else if (result == FLYING_STANDS) {
        fault_raise_with(a, a->start.suspected, a->start.wiring.phase, 0);
    }
}

static void begin_field(struct axis *a)
{
    sensorless_begin(a);
    a->start.phase = START_FIELD;
}

/* The wiring is right: the refusal is reported. */
static void raise_saliency(struct axis *a)
{
    const int32_t detail_q8 = a->injection.detail_q8;
    fault_raise_with(a, FAULT_SALIENCY, detail_q8 / 256, (detail_q8 % 256) * 100 / 256);
}

void start_sensorless_wired(struct axis *a)
{
    injection_reset(&a->loop, &a->tuning);
    if (FEATURE_IN(INJECTION) && a->start.suspected == FAULT_SALIENCY) {
        raise_saliency(a);
        return;
    }
    if (!FEATURE_IN(INJECTION) || !injection_wanted(a)) {
        begin_field(a);
        return;
    }
    start_follow(a, LOOP_INJECTION);
    injection_begin(a);
    a->start.phase = START_INJECTION;
}

/* Falls back to I-f control, if a prescribed field can hold this motor; otherwise the start fails. */
static void do_without_injection(struct axis *a)
{
    injection_reset(&a->loop, &a->tuning);
    start_follow(a, LOOP_OBSERVER);
    begin_field(a);
}

/* A phase lost since the wiring test looks like too little saliency: the wiring is tested again. */
static void refuse_saliency(struct axis *a)
{
    if (!a->tuning.reluctant) {
        do_without_injection(a);
        return;
    }
    injection_reset(&a->loop, &a->tuning);
    a->start.suspected = FAULT_SALIENCY;
    start_open_gates(a);
}

static void refuse_polarity(struct axis *a)
{
    if (!a->tuning.reluctant) {
        do_without_injection(a);
        return;
    }
    fault_raise_with(a, FAULT_POLARITY, (int32_t)a->injection.push_ms, 0);
}

/* True when operation may begin. */
static bool step_injection(struct axis *a)
{
    switch (injection_start_step(a)) {
    case INJECTION_DONE:
        a->start.phase = START_FOLLOW;
        return true;
    case INJECTION_SALIENCY:
        refuse_saliency(a);
        return false;
    case INJECTION_POLARITY:
        refuse_polarity(a);
        return false;
    case INJECTION_RUNNING:
    default:
        return false;
    }
}

bool start_sensorless_step(struct axis *a)
{
    switch (a->start.phase) {
    case START_CATCH:
        return step_catch(a);
    case START_CHECK_TURNING:
        step_check_turning(a);
        return false;
    case START_INJECTION:
        return FEATURE_IN(INJECTION) && step_injection(a);
    case START_FIELD:
    default:
        if (!sensorless_align(a)) {
            return false;
        }
        a->start.phase = START_FOLLOW;
        return true;
    }
}

bool start_sensorless_holds_voltage(const struct axis *a)
{
    const uint32_t phase = a->start.phase;
    return phase == START_FIELD || (FEATURE_IN(INJECTION) && phase == START_INJECTION && injection_brakes(a));
}

const struct start_source start_by_observer = {.before = rotor_take_speed,
                                               .after = sensorless_follow,
                                               .begin = sensorless_begin_start,
                                               .calibrated = sensorless_calibrated,
                                               .wired = start_sensorless_wired,
                                               .wiring_failed = sensorless_wiring_failed,
                                               .step = start_sensorless_step,
                                               .holds_voltage = start_sensorless_holds_voltage};
