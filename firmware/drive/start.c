/* SPDX-License-Identifier: MIT */
#include "firmware/drive/start.h"

#include "firmware/axis/axis.h"
#include "firmware/drive/start_parts.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

#define DRIVEN_COUNTS 256
#define TURNING_TRIES 8u /* of 128 ms each: time for a rotor to run down */

static uint32_t latched(const struct axis *a)
{
    return encoder_latched(&a->fabric->encoder);
}

/* ---- index ---- */

static bool start_index_seen(const struct axis *a)
{
    return (encoder_status(&a->fabric->encoder) & ENCODER_STATUS_INDEX_SEEN) != 0u;
}

static uint32_t index_q32(const struct axis *a)
{
    return encoder_index(&a->fabric->encoder) * a->loop.encoder_scale_q32;
}

void start_learn_index(struct axis *a)
{
    if (a->start.aligned && !a->start.index_known && start_index_seen(a)) {
        a->start.index_offset_q32 = a->loop.angle_offset_q32 + index_q32(a);
        a->start.index_known = true;
    }
}

static void take_offset_from_index(struct axis *a)
{
    if (!a->start.aligned && a->start.index_known && start_index_seen(a)) {
        a->loop.angle_offset_q32 = a->start.index_offset_q32 - index_q32(a);
        a->start.aligned = true;
    }
}

void start_forget(struct axis *a)
{
    a->start.aligned = false;
    a->start.index_known = false;
    a->start.rescaled = true;
    a->start.wired = false;
}

/* ---- the way ---- */

void start_begin(struct axis *a)
{
    struct start *const s = &a->start;
    take_offset_from_index(a);
    if (s->rescaled) {
        pll_reset(&a->loop.pll, latched(a) * a->loop.encoder_scale_q32);
        s->rescaled = false;
    }
    if (rotor_has_hall(a)) {
        start_hall_begin(a);
    }
    calibration_start(&s->calibration);
    s->latched = latched(a);
    s->tries = 0;
    s->phase = START_CALIBRATE;
}

/* In counts, since the zero measurement began: the shorter way round. */
static int32_t moved(const struct axis *a)
{
    const int32_t way = (int32_t)latched(a) - (int32_t)a->start.latched;
    const int32_t size = q15_abs(way);
    return q15_min(size, a->tuning.encoder_counts - size);
}

/* An aligned drive may start while turning; if the angle must be found, the rotor must stand, or is caught. */
static void leave_calibration(struct axis *a)
{
    struct start *const s = &a->start;
    if (rotor_has_hall(a)) {
        start_hall(a);
        return;
    }
    if (rotor_is_sensorless(a)) {
        start_sensorless(a);
        return;
    }
    if (s->aligned || moved(a) <= 2 + a->tuning.encoder_counts / 1024) {
        start_open_gates(a);
        return;
    }
    s->tries++;
    if (s->tries >= TURNING_TRIES) {
        fault_raise_with(a, FAULT_ROTOR_TURNING, moved(a), a->tuning.encoder_counts);
    }
    calibration_start(&s->calibration);
    s->latched = latched(a);
}

static void step_calibration(struct axis *a)
{
    switch (calibration_step(&a->start.calibration, &a->fabric->adc)) {
    case CALIBRATION_DONE:
        leave_calibration(a);
        break;
    case CALIBRATION_OUT_OF_RANGE:
        fault_raise(a, FAULT_CURRENT_OFFSET);
        break;
    case CALIBRATION_RUNNING:
    default:
        break;
    }
}

/* A third of an electrical turn: few test currents turn a rotor that far, and turning magnets induce currents of any sign. */
static bool start_driven(const struct axis *a)
{
    if (a->identify.running) {
        return moved(a) > DRIVEN_COUNTS; /* counts per turn are unknown */
    }
    if (rotor_has_hall(a)) {
        return start_hall_moved(a) > 2;
    }
    return rotor_has_encoder(a) && moved(a) * 3 * a->tuning.pole_pairs > a->tuning.encoder_counts;
}

/* Without an encoder the bridge goes off first, and the EMF tells whether the rotor is driven. */
static void raise_of_wiring(struct axis *a, enum fault fault)
{
    struct start *const s = &a->start;
    if (rotor_is_sensorless(a)) {
        start_doubt(a, fault);
    } else if (start_driven(a)) {
        fault_raise_with(a, FAULT_LOAD_TOO_HIGH, ALIGNMENT_OUT_DEGREES, 0);
    } else {
        fault_raise_with(a, fault, s->wiring.phase, 0);
    }
}

static void step_wiring(struct axis *a)
{
    struct start *const s = &a->start;
    switch (wiring_step(&s->wiring, &a->loop, &a->tuning, &a->fabric->adc)) {
    case WIRING_GOOD:
        s->unseen = false;
        if (rotor_has_hall(a)) {
            start_hall_wired(a);
            break;
        }
        if (rotor_is_sensorless(a)) {
            start_sensorless_wired(a);
            break;
        }
        alignment_start(&s->alignment, &a->loop, &a->tuning, latched(a));
        s->phase = a->identify.running ? START_IDENTIFY : s->aligned ? START_FOLLOW : START_ALIGN;
        break;
    case WIRING_OPEN:
        raise_of_wiring(a, FAULT_OPEN_PHASE);
        break;
    case WIRING_SIGN:
        raise_of_wiring(a, FAULT_SENSOR_SIGN);
        break;
    case WIRING_RUNNING:
    default:
        break;
    }
}

static const enum fault fault_of_alignment[] = {
    [ALIGNMENT_ENCODER_DEAD] = FAULT_ENCODER_DEAD, [ALIGNMENT_DIRECTION] = FAULT_ENCODER_DIRECTION,
    [ALIGNMENT_POLE_PAIRS] = FAULT_POLE_PAIRS,     [ALIGNMENT_COUNTS] = FAULT_ENCODER_COUNTS,
    [ALIGNMENT_BLOCKED] = FAULT_ROTOR_BLOCKED,     [ALIGNMENT_LOAD] = FAULT_LOAD_TOO_HIGH,
};

static void step_alignment(struct axis *a)
{
    struct alignment *const m = &a->start.alignment;
    const enum alignment_result result = alignment_step(m, &a->loop, &a->tuning, latched(a));
    if (result == ALIGNMENT_DONE) {
        a->start.aligned = true;
        a->start.index_known = false; /* the stored value is older */
        a->start.phase = START_FOLLOW;
    } else if (result != ALIGNMENT_RUNNING) {
        fault_raise_with(a, fault_of_alignment[result], m->detail[0], m->detail[1]);
    }
}

/* The rotor is at rest, and the bridge off for some microseconds: changes the encoder scale and the frame. */
static void start_take_over(struct axis *a)
{
    struct identify *const d = &a->identify;
    const uint32_t angle_q32 = identify_angle_q32(d, &a->loop);
    current_loop_off(&a->loop, a->fabric);
    a->tuning = d->tuning;
    (void)encoder_init(&a->fabric->encoder, (uint32_t)d->params.encoder_counts, d->backwards);
    current_loop_tune(&a->loop, &a->tuning);
    speed_estimate_reset(&a->speed.estimate);
    speed_loop_tune(&a->speed, &a->tuning);
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
    case START_ALIGN:
        step_alignment(a);
        return false;
    case START_CATCH:
    case START_DOUBT:
    case START_FIELD:
    case START_INJECTION:
        return FEATURE_IN(SENSORLESS) && start_sensorless_step(a);
    case START_IDENTIFY:
        return FEATURE_IN(IDENTIFY) && step_identify(a);
    case START_HALL:
    case START_LAY_HALL:
    case START_LEARN_HALL:
        return FEATURE_IN(HALL) && start_hall_step(a);
    case START_FOLLOW:
    default:
        if (a->loop.source != LOOP_ENCODER) {
            start_follow(a, LOOP_ENCODER);
        }
        return true;
    }
}

const struct tuning *start_tuning(const struct axis *a)
{
    const struct start *const s = &a->start;
    if (FEATURE_IN(IDENTIFY) && a->state == AXIS_SWITCHED_ON && s->phase == START_IDENTIFY &&
        !identify_in_rotor_frame(&a->identify)) {
        return identify_tuning(&a->identify);
    }
    const bool voltage = s->phase == START_WIRING || (FEATURE_IN(SENSORLESS) && start_sensorless_holds_voltage(a)) ||
                         (s->phase == START_ALIGN && alignment_holds_voltage(&s->alignment));
    return a->state == AXIS_SWITCHED_ON && voltage ? &wiring_tuning : &a->tuning;
}
