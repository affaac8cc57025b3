/* SPDX-License-Identifier: MIT */
#include "firmware/drive/start.h"

#include <stddef.h>

#include "firmware/axis/axis.h"
#include "firmware/drive/retune.h"
#include "firmware/drive/start_parts.h"
#include "firmware/settings/features.h"

static const struct start_source *const start_sources[] = {
    [PARAM_ANGLE_ENCODER] = FEATURE_IN(ENCODER) ? &start_by_encoder : NULL,
    [PARAM_ANGLE_SENSORLESS] = FEATURE_IN(SENSORLESS) ? &start_by_observer : NULL,
    [PARAM_ANGLE_HALL] = FEATURE_IN(HALL) ? &start_by_hall : NULL,
};

/* The tuning has refused a source that the build leaves out. */
static const struct start_source *source_of(const struct axis *a)
{
    return start_sources[a->tuning.angle_source];
}

void start_forget(struct axis *a)
{
    a->start.aligned = false;
    a->start.index_known = false;
    a->start.remembered = false;
    a->start.rescaled = true;
    a->start.wired = false;
}

/* The encoder's count no longer matches the alignment. */
static bool loses_count(enum fault cause)
{
    return cause == FAULT_ENCODER || cause == FAULT_ENCODER_SLIP || cause == FAULT_ENCODER_DEAD ||
           cause == FAULT_ENCODER_COUNTS;
}

/* What a wrong offset may look like, by whatever name: not a cable that is cut, which the signals show. */
static bool may_be_offset(enum fault cause)
{
    return (loses_count(cause) && cause != FAULT_ENCODER) || cause == FAULT_STALL || cause == FAULT_SPEED_DEVIATION ||
           cause == FAULT_OVERSPEED || cause == FAULT_FOLLOWING_ERROR || cause == FAULT_LIMIT_CYCLE ||
           cause == FAULT_OSCILLATION || cause == FAULT_HOMING;
}

void start_doubt(struct axis *a, enum fault cause)
{
    struct start *const s = &a->start;
    if (cause == FAULT_OFFSET || (s->remembered && may_be_offset(cause))) {
        s->aligned = false;
        s->index_known = false;
    } else if (loses_count(cause)) {
        s->aligned = false; /* and the index must be seen again */
        encoder_clear(&a->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
    }
}

void start_begin(struct axis *a)
{
    struct start *const s = &a->start;
    if (s->rescaled) {
        pll_reset(&a->loop.pll, encoder_latched(&a->fabric->encoder) * a->loop.encoder_scale_q32);
        s->rescaled = false;
    }
    source_of(a)->begin(a);
    calibration_start(&s->calibration);
    s->phase = START_CALIBRATE;
}

static void step_calibration(struct axis *a)
{
    switch (calibration_step(&a->start.calibration, &a->fabric->adc)) {
    case CALIBRATION_DONE:
        source_of(a)->calibrated(a);
        break;
    case CALIBRATION_OUT_OF_RANGE:
        fault_raise(a, FAULT_CURRENT_OFFSET);
        break;
    case CALIBRATION_RUNNING:
    default:
        break;
    }
}

/* True of a rotor that its source sees driven: turning magnets induce currents of any sign. */
static bool load_shows(struct axis *a)
{
    const struct start_source *const source = source_of(a);
    const bool driven = source->driven != NULL && source->driven(a);
    if (driven) {
        fault_raise_with(a, FAULT_LOAD_TOO_HIGH, ALIGNMENT_OUT_DEGREES, 0);
    }
    return driven;
}

/* A sign or an order is looked at twice. */
static void wiring_looks(struct axis *a, enum fault fault)
{
    struct start *const s = &a->start;
    if (load_shows(a)) {
        return;
    }
    if (fault != FAULT_OPEN_PHASE && !s->wiring.patient) {
        wiring_start(&s->wiring, true);
    } else if (source_of(a)->doubt != NULL) {
        source_of(a)->doubt(a, fault);
    } else {
        fault_raise_with(a, fault, s->wiring.phase, 0);
    }
}

static void step_wiring(struct axis *a)
{
    struct start *const s = &a->start;
    if (s->wiring.patient && load_shows(a)) {
        return;
    }
    switch (wiring_step(&s->wiring, &a->loop, &a->tuning, &a->fabric->adc)) {
    case WIRING_GOOD:
        s->unseen = false;
        source_of(a)->wired(a);
        break;
    case WIRING_OPEN:
        wiring_looks(a, FAULT_OPEN_PHASE);
        break;
    case WIRING_SIGN:
        wiring_looks(a, FAULT_SENSOR_SIGN);
        break;
    case WIRING_EXCHANGED:
        wiring_looks(a, FAULT_SENSORS_EXCHANGED);
        break;
    case WIRING_RUNNING:
    default:
        break;
    }
}

/* The rotor is at rest, and the bridge off for some microseconds: changes the encoder scale and the frame. */
static void start_take_over(struct axis *a)
{
    struct identify *const d = &a->identify;
    const uint32_t angle_q32 = identify_angle_q32(d, &a->loop);
    current_loop_off(&a->loop, a->fabric);
    retune_to(a, &d->tuning);
    current_loop_tune(&a->loop, &a->tuning);
    (void)encoder_init(&a->fabric->encoder, (uint32_t)d->params.encoder_counts, d->backwards);
    speed_estimate_reset(&a->speed.estimate);
    turns_begin(&a->motion.turns, 0);
    pll_reset(&a->loop.pll, 0);
    a->loop.angle_offset_q32 = angle_q32;
    start_follow(a, LOOP_ENCODER);
    identify_taken(d);
}

static bool step_identify(struct axis *a)
{
    if (identify_takes_over(&a->identify)) {
        start_take_over(a);
        return false;
    }
    const struct measure_io io = {.loop = &a->loop, .fabric = a->fabric, .speed = &a->speed, .tuning = &a->tuning};
    return identify_step(&a->identify, &io);
}

bool start_step(struct axis *a)
{
    struct start *const s = &a->start;
    switch (s->phase) {
    case START_CALIBRATE:
        step_calibration(a);
        return false;
    case START_WIRING:
        step_wiring(a);
        return false;
    case START_IDENTIFY:
        return FEATURE_IN(IDENTIFY) && step_identify(a);
    default:
        return source_of(a)->step(a);
    }
}

const struct tuning *start_tuning(const struct axis *a)
{
    const uint32_t phase = a->start.phase;
    if (FEATURE_IN(IDENTIFY) && phase == START_IDENTIFY && !identify_in_rotor_frame(&a->identify)) {
        return identify_tuning(&a->identify);
    }
    return phase == START_WIRING || source_of(a)->holds_voltage(a) ? &wiring_tuning : &a->tuning;
}
