/* SPDX-License-Identifier: MIT */
#include "firmware/axis/start.h"

#include "firmware/axis/axis.h"
#include "firmware/axis/rotor.h"
#include "lib/q15.h"

#define DRIVEN_COUNTS 256
#define TURNING_TRIES 8u /* of 128 ms each: so long a rotor may run out */

enum start_phase {
    START_CALIBRATE,
    START_WIRING,
    START_ALIGN,
    START_FOLLOW,    /* from the prescribed field to the rotor's, for which the bridge is off for a moment */
    START_FIELD,     /* without an encoder: the rotor is to hang on a field */
    START_IDENTIFY,  /* in place of the alignment: it ends with the bridge off */
    START_CATCH,     /* without an encoder: does the rotor turn already? */
    START_DOUBT,     /* likewise: did it turn while the wiring looked wrong? */
    START_INJECTION, /* or its saliency is to show it */
};

static uint32_t latched(const struct axis *a)
{
    return encoder_latched(&a->fabric->encoder);
}

/* ---- index ---- */

static bool index_seen(const struct axis *a)
{
    return (encoder_status(&a->fabric->encoder) & ENCODER_STATUS_INDEX_SEEN) != 0u;
}

static uint32_t index_q32(const struct axis *a)
{
    return encoder_index(&a->fabric->encoder) * a->loop.encoder_scale_q32;
}

void start_learn_index(struct axis *a)
{
    if (a->start.aligned && !a->start.index_known && index_seen(a)) {
        a->start.index_offset_q32 = a->loop.angle_offset_q32 + index_q32(a);
        a->start.index_known = true;
    }
}

static void take_offset_from_index(struct axis *a)
{
    if (!a->start.aligned && a->start.index_known && index_seen(a)) {
        a->loop.angle_offset_q32 = a->start.index_offset_q32 - index_q32(a);
        a->start.aligned = true;
    }
}

void start_forget(struct axis *a)
{
    a->start.aligned = false;
    a->start.index_known = false;
    a->start.rescaled = true;
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
    calibration_start(&s->calibration);
    s->latched = latched(a);
    s->tries = 0;
    s->phase = START_CALIBRATE;
}

/* In counts, since the zero of the sensors was begun: the shorter way round. */
static int32_t moved(const struct axis *a)
{
    const int32_t way = (int32_t)latched(a) - (int32_t)a->start.latched;
    const int32_t size = q15_abs(way);
    return q15_min(size, a->tuning.encoder_counts - size);
}

/* The bridge on, the field's angle from `source`. */
static void follow(struct axis *a, enum loop_source source)
{
    current_loop_off(&a->loop, a->fabric);
    if (current_loop_select(&a->loop, a->fabric, source, LOOP_SENSE_AB)) {
        current_loop_on(&a->loop, a->fabric, &a->tuning);
    } else {
        axis_raise(a, FAULT_FABRIC); /* the gate does not let go */
    }
}

static void open_gates(struct axis *a)
{
    struct start *const s = &a->start;
    const bool known = s->aligned && !s->unseen;
    if (!rotor_has_encoder(a)) {
        follow(a, LOOP_OBSERVER);
    } else {
        follow(a, known ? LOOP_ENCODER : LOOP_FORCED);
    }
    wiring_start(&s->wiring);
    s->phase = known ? START_FOLLOW : START_WIRING;
}

/* An aligned drive may start turning; whose angle has to be found must stand, or is caught. */
static void leave_calibration(struct axis *a)
{
    struct start *const s = &a->start;
    if (!rotor_has_encoder(a)) {
        injection_reset(&a->loop, &a->tuning); /* what it followed last time */
        flying_begin(a);
        s->phase = START_CATCH;
        return;
    }
    if (s->aligned || moved(a) <= 2 + a->tuning.encoder_counts / 1024) {
        open_gates(a);
        return;
    }
    s->tries++;
    if (s->tries >= TURNING_TRIES) {
        axis_raise_with(a, FAULT_ROTOR_TURNING, moved(a), a->tuning.encoder_counts);
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
        axis_raise(a, FAULT_CURRENT_OFFSET);
        break;
    case CALIBRATION_RUNNING:
    default:
        break;
    }
}

/* A third of an electrical turn: few test currents turn a rotor so far, and magnets that turn induce currents of any sign. */
static bool driven(const struct axis *a)
{
    if (a->identify.running) {
        return moved(a) > DRIVEN_COUNTS; /* nobody knows how many are a turn */
    }
    return rotor_has_encoder(a) && moved(a) * 3 * a->tuning.pole_pairs > a->tuning.encoder_counts;
}

/* Without an encoder the bridge goes off first, and the EMF says whether the rotor is driven. */
static void raise_of_wiring(struct axis *a, enum fault fault)
{
    struct start *const s = &a->start;
    if (!rotor_has_encoder(a)) {
        current_loop_off(&a->loop, a->fabric);
        flying_begin(a);
        s->doubted = fault;
        s->phase = START_DOUBT;
    } else if (driven(a)) {
        axis_raise_with(a, FAULT_LOAD_TOO_HIGH, ALIGNMENT_OUT_DEGREES, 0);
    } else {
        axis_raise_with(a, fault, s->wiring.phase, 0);
    }
}

static void step_doubt(struct axis *a)
{
    const enum flying_result result = flying_step(a);
    if (result == FLYING_CAUGHT) {
        axis_raise_with(a, FAULT_LOAD_TOO_HIGH, ALIGNMENT_OUT_DEGREES, 0);
    } else if (result == FLYING_STANDS) {
        axis_raise_with(a, a->start.doubted, a->start.wiring.phase, 0);
    }
}

static void begin_field(struct axis *a)
{
    sensorless_begin(a);
    a->start.phase = START_FIELD;
}

static void begin_without_encoder(struct axis *a)
{
    injection_reset(&a->loop, &a->tuning);
    if (!injection_wanted(a)) {
        begin_field(a);
        return;
    }
    follow(a, LOOP_INJECTION);
    injection_begin(a);
    a->start.phase = START_INJECTION;
}

/* A motor that a prescribed field can hold does without; of the other ones it was the only way. */
static void refuse_injection(struct axis *a, enum fault fault, int32_t detail_0, int32_t detail_1)
{
    if (a->tuning.reluctant) {
        axis_raise_with(a, fault, detail_0, detail_1);
        return;
    }
    injection_reset(&a->loop, &a->tuning);
    follow(a, LOOP_OBSERVER);
    begin_field(a);
}

/* True when operation may begin. */
static bool step_injection(struct axis *a)
{
    const struct injection_start *const s = &a->injection;
    switch (injection_start_step(a)) {
    case INJECTION_DONE:
        a->start.phase = START_FOLLOW;
        return true;
    case INJECTION_SALIENCY:
        refuse_injection(a, FAULT_SALIENCY, s->detail_q8 / 256, (s->detail_q8 % 256) * 100 / 256);
        return false;
    case INJECTION_POLARITY:
        refuse_injection(a, FAULT_POLARITY, tuning_milli_from_q15(s->i_q15, a->params.i_range_ma), 0);
        return false;
    case INJECTION_RUNNING:
    default:
        return false;
    }
}

static void step_wiring(struct axis *a)
{
    struct start *const s = &a->start;
    switch (wiring_step(&s->wiring, &a->loop, &a->tuning, &a->fabric->adc)) {
    case WIRING_GOOD:
        s->unseen = false;
        if (!rotor_has_encoder(a)) {
            begin_without_encoder(a);
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
        a->start.phase = START_FOLLOW;
    } else if (result != ALIGNMENT_RUNNING) {
        axis_raise_with(a, fault_of_alignment[result], m->detail[0], m->detail[1]);
    }
}

/* True when the rotor is caught as it turns. */
static bool step_catch(struct axis *a)
{
    const enum flying_result result = flying_step(a);
    if (result == FLYING_STANDS) {
        open_gates(a);
    }
    return result == FLYING_CAUGHT;
}

/* The rotor is at rest, and the bridge off for some microseconds: another scale of the encoder, another frame. */
static void take_over(struct axis *a)
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
    follow(a, LOOP_ENCODER);
    identify_taken(d);
}

static bool step_identify(struct axis *a)
{
    if (identify_takes_over(&a->identify)) {
        take_over(a);
        return false;
    }
    const struct identify_io io = {.loop = &a->loop, .fabric = a->fabric, .speed = &a->speed, .tuning = &a->tuning};
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
    case START_FIELD:
        if (!sensorless_align(a)) {
            return false;
        }
        s->phase = START_FOLLOW;
        return true;
    case START_CATCH:
        return step_catch(a);
    case START_DOUBT:
        step_doubt(a);
        return false;
    case START_INJECTION:
        return step_injection(a);
    case START_IDENTIFY:
        return step_identify(a);
    case START_FOLLOW:
    default:
        if (a->loop.source != LOOP_ENCODER) {
            follow(a, LOOP_ENCODER);
        }
        return true;
    }
}

const struct tuning *start_tuning(const struct axis *a)
{
    const struct start *const s = &a->start;
    if (a->state == AXIS_SWITCHED_ON && s->phase == START_IDENTIFY && !identify_in_rotor_frame(&a->identify)) {
        return identify_tuning(&a->identify);
    }
    const bool voltage = s->phase == START_WIRING || s->phase == START_FIELD ||
                         (s->phase == START_INJECTION && injection_brakes(a)) ||
                         (s->phase == START_ALIGN && alignment_holds_voltage(&s->alignment));
    return a->state == AXIS_SWITCHED_ON && voltage ? &wiring_tuning : &a->tuning;
}
