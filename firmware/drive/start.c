/* SPDX-License-Identifier: MIT */
#include "firmware/drive/start.h"

#include <stddef.h>

#include "firmware/axis/axis.h"
#include "firmware/drive/retune.h"
#include "firmware/settings/features.h"

#define SOURCE_START(name, feature, start, properties) FEATURE_IN(feature) ? &start_by_##start : NULL,

static const struct start_source *const start_sources[] = {SOURCES(SOURCE_START)};

/* A source that the build leaves out is refused by the tuning. */
static const struct start_source *source_of(const struct axis *a)
{
    return start_sources[a->tuning.angle_source];
}

/* NULL until a tuning with a supported source is in effect. */
void start_source_before(struct axis *a)
{
    if (source_of(a) != NULL) {
        source_of(a)->before(a);
    }
}

void start_source_after(struct axis *a)
{
    if (source_of(a) != NULL && source_of(a)->after != NULL) {
        source_of(a)->after(a);
    }
}

void start_begin(struct axis *a)
{
    struct start *const s = &a->start;
    if (s->rescaled) {
        current_loop_place(&a->loop, encoder_latched(&a->fabric->encoder) * a->loop.encoder_scale_q32, 0);
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

/* True if a load drives the rotor: its EMF drives currents of any sign, which look like wrong wiring. */
static bool is_driven_by_load(struct axis *a)
{
    const struct start_source *const source = source_of(a);
    const bool driven = source->driven != NULL && source->driven(a);
    if (driven) {
        fault_raise_with(a, FAULT_LOAD_TOO_HIGH, ALIGNMENT_OUT_DEGREES, 0);
    }
    return driven;
}

/* A wrong sign or order is tested twice. */
static void wiring_failed(struct axis *a, enum fault fault)
{
    struct start *const s = &a->start;
    if (is_driven_by_load(a)) {
        return;
    }
    if (fault != FAULT_OPEN_PHASE && !s->wiring.slow) {
        wiring_start(&s->wiring, true);
    } else if (source_of(a)->wiring_failed != NULL) {
        source_of(a)->wiring_failed(a, fault);
    } else {
        fault_raise_with(a, fault, s->wiring.phase, 0);
    }
}

static void step_wiring(struct axis *a)
{
    struct start *const s = &a->start;
    if (s->wiring.slow && is_driven_by_load(a)) {
        return;
    }
    switch (wiring_step(&s->wiring, &a->loop, &a->tuning, &a->fabric->adc)) {
    case WIRING_GOOD:
        s->recheck_wiring = false;
        source_of(a)->wired(a);
        break;
    case WIRING_OPEN:
        wiring_failed(a, FAULT_OPEN_PHASE);
        break;
    case WIRING_SIGN:
        wiring_failed(a, FAULT_SENSOR_SIGN);
        break;
    case WIRING_EXCHANGED:
        wiring_failed(a, FAULT_SENSORS_EXCHANGED);
        break;
    case WIRING_RUNNING:
    default:
        break;
    }
}

/* With the rotor at rest and the bridge off for some microseconds: changes encoder scale and frame. */
static void start_take_over(struct axis *a)
{
    struct identify *const d = &a->identify;
    const uint32_t angle_q32 = identify_angle_q32(d, &a->loop);
    current_loop_off(&a->loop, a->fabric);
    retune_all(a, &d->tuning);
    current_loop_tune(&a->loop, &a->tuning);
    (void)encoder_init(&a->fabric->encoder, (uint32_t)d->params.encoder_counts, d->backwards);
    speed_estimate_reset(&a->speed.estimate);
    turns_begin(&a->motion.turns, 0);
    current_loop_place(&a->loop, 0, 0);
    current_loop_offset(&a->loop, angle_q32);
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
