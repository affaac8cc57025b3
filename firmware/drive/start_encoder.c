/* SPDX-License-Identifier: MIT */
/* A start with an encoder: alignment, unless its relation to the magnets is known already, by its count or by the index. */
#include "firmware/axis/axis.h"
#include "firmware/drive/start.h"
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
        current_loop_offset(&a->loop, a->start.index_offset_q32 - index_q32(a));
        a->start.aligned = true;
    }
}

/* The next start aligns. */
static void start_forget_offset(struct start *s)
{
    s->aligned = false;
    s->remembered = false;
}

/* ---- after a fault ---- */

/* The encoder's count no longer matches the alignment. */
static bool loses_count(enum fault cause)
{
    return cause == FAULT_ENCODER || cause == FAULT_ENCODER_SLIP || cause == FAULT_ENCODER_DEAD ||
           cause == FAULT_ENCODER_COUNTS;
}

/* Faults that a wrong offset can cause; not a cut cable, which the signals show. */
static bool may_be_offset(enum fault cause)
{
    return (loses_count(cause) && cause != FAULT_ENCODER) || cause == FAULT_STALL || cause == FAULT_SPEED_DEVIATION ||
           cause == FAULT_OVERSPEED || cause == FAULT_FOLLOWING_ERROR || cause == FAULT_LIMIT_CYCLE ||
           cause == FAULT_OSCILLATION || cause == FAULT_HOMING;
}

void start_forget_after(struct axis *a, enum fault cause)
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

/* ---- the phases of a start ---- */

/* Signals lost while the bridge was off are no fault, but counts may be missing: aligns again. */
static void forget_lost_signals(struct axis *a)
{
    struct encoder_regs *const encoder = &a->fabric->encoder;
    if ((encoder_status(encoder) & (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)) != 0u) {
        encoder_clear(encoder, ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST);
        start_forget_after(a, FAULT_ENCODER);
    }
}

static void encoder_begin(struct axis *a)
{
    forget_lost_signals(a);
    take_offset_from_index(a);
    a->start.remembered = a->start.aligned;
    a->start.latched = latched(a);
    a->start.tries = 0;
}

/* Counts since the zero measurement began: the shorter direction around the turn. */
static int32_t moved(const struct axis *a)
{
    const int32_t travel = (int32_t)latched(a) - (int32_t)a->start.latched;
    const int32_t size = q15_abs(travel);
    return q15_min(size, a->tuning.encoder_counts - size);
}

static void wait_for_rest(struct axis *a)
{
    struct start *const s = &a->start;
    s->tries++;
    if (s->tries >= TURNING_TRIES) {
        fault_raise_with(a, FAULT_ROTOR_TURNING, moved(a), a->tuning.encoder_counts);
    }
    calibration_start(&s->calibration);
    s->latched = latched(a);
    s->phase = START_CALIBRATE;
}

/* An aligned drive may start while turning; otherwise the rotor must be at rest for alignment. */
static void encoder_calibrated(struct axis *a)
{
    struct start *const s = &a->start;
    const bool stands = moved(a) <= 2 + a->tuning.encoder_counts / 1024;
    if (stands && s->remembered && offset_check_is_blind(&a->tuning)) {
        start_forget_offset(s);
    }
    if (s->aligned || stands) {
        offset_check_start(&s->check, &a->tuning, latched(a), !stands);
        start_open_gates(a);
    } else {
        wait_for_rest(a);
    }
}

/* More than a third of an electrical turn: test currents rarely turn a rotor that far, so a load drives it. */
static bool encoder_driven(const struct axis *a)
{
    if (a->identify.running) {
        return moved(a) > DRIVEN_COUNTS; /* counts per turn are unknown */
    }
    return moved(a) * 3 * a->tuning.pole_pairs > a->tuning.encoder_counts;
}

static void encoder_wired(struct axis *a)
{
    struct start *const s = &a->start;
    alignment_start(&s->alignment, &a->loop, &a->tuning, latched(a));
    s->phase = a->identify.running ? START_IDENTIFY
               : !s->aligned       ? START_ALIGN
               : s->remembered     ? START_CONFIRM
                                   : START_FOLLOW;
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

/* A rotor that turns too slowly to show its angle is checked again; one at rest that does not move is aligned. */
static void repeat_check(struct axis *a)
{
    if (a->start.check.turns) {
        current_loop_off(&a->loop, a->fabric);
        wait_for_rest(a);
    } else {
        start_forget_offset(&a->start);
        start_open_gates(a);
    }
}

static void step_check(struct axis *a)
{
    struct offset_check *const o = &a->start.check;
    switch (offset_check_step(o, &a->loop, &a->tuning, latched(a))) {
    case OFFSET_WRONG:
        fault_raise_with(a, FAULT_OFFSET, o->off_deg, 0);
        break;
    case OFFSET_UNKNOWN:
        repeat_check(a);
        break;
    case OFFSET_RIGHT:
        a->start.phase = START_FOLLOW;
        break;
    case OFFSET_RUNNING:
    default:
        break;
    }
}

static bool encoder_step(struct axis *a)
{
    if (a->start.phase == START_ALIGN) {
        step_alignment(a);
        return false;
    }
    if (a->loop.source != LOOP_ENCODER) {
        start_follow(a, LOOP_ENCODER);
    }
    if (a->start.phase == START_CONFIRM) {
        step_check(a);
        return false;
    }
    return true;
}

static bool encoder_holds_voltage(const struct axis *a)
{
    return a->start.phase == START_ALIGN && alignment_holds_voltage(&a->start.alignment);
}

const struct start_source start_by_encoder = {.before = rotor_count,
                                              .begin = encoder_begin,
                                              .calibrated = encoder_calibrated,
                                              .wired = encoder_wired,
                                              .driven = encoder_driven,
                                              .step = encoder_step,
                                              .holds_voltage = encoder_holds_voltage};
