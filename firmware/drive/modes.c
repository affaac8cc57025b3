/* SPDX-License-Identifier: MIT */
#include "firmware/drive/modes.h"

#include "firmware/axis/axis.h"
#include "firmware/control/friction.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

/* ---- entering ---- */

#define UNITS_MOST 8000000 /* twice speed_max: the profile's sums have 31 bits */

/* The present reference speed, in the profile's units. A 64-bit division. */
static int32_t units_of_rpm_q16(const struct tuning *t, int32_t rpm_q16)
{
    const int64_t units = (int64_t)rpm_q16 * (1 << 20) / t->rpm_per_unit_q20;
    return units > UNITS_MOST ? UNITS_MOST : (units < -UNITS_MOST ? -UNITS_MOST : (int32_t)units);
}

/* The shaft's position at the next step, at the speed loop's reference speed. */
static void begin_position(struct axis *a)
{
    struct motion *const m = &a->motion;
    const int32_t speed = units_of_rpm_q16(&a->tuning, a->speed.ref_rpm_q16);
    const int64_t here = position_of_shaft(&m->turns, &a->speed.estimate, &a->tuning, speed != 0);
    position_begin(&m->position, here + speed, speed);
}

/* Continues the reference of the mode that held the position so far. */
static void take_over_position(struct axis *a, enum axis_mode mode)
{
    struct motion *const m = &a->motion;
    if (!axis_mode_is_position(a->mode)) {
        begin_position(a);
    }
    if (mode == AXIS_MODE_POSITION) {
        profile_begin(&m->profile, &a->tuning.profile, m->position.ref, m->position.ref_speed);
    } else {
        cyclic_begin(&m->cyclic, m->position.ref);
    }
}

void modes_enter(struct axis *a, enum axis_mode mode)
{
    struct motion *const m = &a->motion;
    if (a->mode == (uint32_t)mode) {
        return;
    }
    if (axis_mode_is_torque(a->mode) && !axis_mode_is_torque(mode)) {
        speed_loop_reset(&a->speed, a->torque.torque_q15);
    }
    if (axis_mode_is_position(mode)) {
        take_over_position(a, mode);
    } else if (mode == AXIS_MODE_CYCLIC_SPEED) {
        cyclic_begin(&m->cyclic, a->speed.ref_rpm_q16);
    } else if (mode == AXIS_MODE_CYCLIC_TORQUE) {
        cyclic_begin(&m->cyclic, (int64_t)a->torque.torque_q15 * 65536);
    }
    a->mode = mode;
}

void modes_set_zero(struct axis *a, int64_t counts)
{
    struct motion *const m = &a->motion;
    const int64_t by = -counts * (1LL << a->tuning.profile.shift);
    m->turns.counts -= counts;
    m->position.ref += by;
    profile_shift(&m->profile, by);
    if (a->mode == AXIS_MODE_CYCLIC_POSITION) {
        m->cyclic.now += by;
        m->cyclic.target += by;
    }
}

/* ---- a step ---- */

/* Homing has less, so that the hard stop holds and the machine does not give. */
static int32_t i_limit_q15(const struct axis *a)
{
    const int32_t most_q15 = thermal_i_limit_q15(&a->thermal, a->tuning.i_max_q15);
    return a->mode == AXIS_MODE_HOMING ? q15_min(most_q15, a->tuning.home_i_q15) : most_q15;
}

void modes_limit_torque(struct axis *a)
{
    const struct torque_view view = {
        .speed_rpm_q4 = a->speed.speed_rpm_q4,
        .i_limit_q15 = i_limit_q15(a),
        .limit_speed = axis_mode_is_torque(a->mode),
    };
    torque_set_limits(&a->torque, &a->tuning, &view);
}

void modes_ask(struct axis *a, int32_t torque_q15)
{
    torque_ask(&a->torque, &a->loop, &a->tuning, torque_q15);
}

int32_t modes_known_torque_q15(struct axis *a)
{
    struct motion *const m = &a->motion;
    const int32_t friction_q15 = friction_torque_q15(&a->speed, &a->tuning, axis_mode_is_position(a->mode));
    if (m->cogging.count == 0) {
        return friction_q15;
    }
    m->cogging_q15 = cogging_torque_q15(&m->cogging, &a->speed.estimate, &a->tuning);
    return m->cogging_q15 + friction_q15;
}

/*
 * Computes what the speed loop may ask for on top of the feed-forward torque for cogging and friction. torque_ask() limits the
 * total. Returns the feed-forward torque.
 */
static int32_t room_beside_known(struct axis *a, struct interval *room)
{
    *room = a->torque.limits;
    a->speed.torque_is_slow = a->torque.flux.decides;
    if (!rotor_has_encoder(a)) {
        return 0;
    }
    const int32_t known_q15 = modes_known_torque_q15(a);
    room->low -= known_q15;
    room->high -= known_q15;
    return known_q15;
}

void modes_control_speed(struct axis *a, int32_t slope_q16)
{
    const bool encoder = rotor_has_encoder(a);
    if (!encoder && sensorless_lead_field(a, slope_q16)) {
        return;
    }
    struct interval room;
    const int32_t known_q15 = room_beside_known(a, &room);
    modes_ask(a, known_q15 + speed_loop_step(&a->speed, &a->tuning, slope_q16, &room));
    if (!encoder) {
        sensorless_after_control(a);
    }
}

/* A prescribed field has no torque control: it moves the way the torque would drive the rotor, until the observer leads. */
static bool field_goes_along(struct axis *a)
{
    const int32_t far_rpm = a->torque_command_q15 == 0 ? 0 : a->params.speed_max_rpm;
    if (rotor_is_known(a)) {
        return false;
    }
    a->speed.target_rpm_q16 = (a->torque_command_q15 < 0 ? -far_rpm : far_rpm) * 65536;
    return sensorless_lead_field(a, a->tuning.ramp_q16);
}

static int32_t whole(int64_t counts)
{
    return counts > INT32_MAX ? INT32_MAX : (counts < INT32_MIN ? INT32_MIN : (int32_t)counts);
}

static void control_position(struct axis *a, int64_t next_ref)
{
    struct motion *const m = &a->motion;
    struct interval room;
    const int32_t known_q15 = room_beside_known(a, &room);
    modes_ask(a, known_q15 + position_step(&m->position, next_ref, &a->speed, &m->turns, &a->tuning, &room));
    if (position_is_lost(&m->position, &a->tuning)) {
        fault_report(a, FAULT_FOLLOWING_ERROR, m->position.error_counts, 0);
    }
}

static void step_profile(struct axis *a)
{
    profile_step(&a->motion.profile, &a->tuning.profile);
    control_position(a, a->motion.profile.position);
}

static void control_cyclic_speed(struct axis *a)
{
    const int32_t before_q16 = (int32_t)a->motion.cyclic.now;
    const int32_t now_q16 = (int32_t)cyclic_step(&a->motion.cyclic);
    struct interval room;
    const int32_t known_q15 = room_beside_known(a, &room);
    modes_ask(a, known_q15 + speed_loop_follow(&a->speed, &a->tuning, now_q16, now_q16 - before_q16, &room));
}

static bool index_seen(const struct axis *a)
{
    return (encoder_status(&a->fabric->encoder) & ENCODER_STATUS_INDEX_SEEN) != 0u;
}

static void finish_homing(struct axis *a)
{
    struct motion *const m = &a->motion;
    if (m->homing.method == HOMING_BLOCK) {
        speed_loop_reset(&a->speed, 0); /* it pushed */
    }
    modes_enter(a, AXIS_MODE_POSITION);
    modes_set_zero(a, m->homing.zero);
    m->homed = true;
    profile_aim(&m->profile, position_of_counts(0, &a->tuning));
}

/* An index comes within a turn. */
static int64_t farthest(const struct axis *a)
{
    const int64_t turn = a->tuning.encoder_counts;
    return a->motion.homing.method == HOMING_INDEX ? turn + turn / 4 : turn * a->params.home_turns;
}

static void step_homing(struct axis *a)
{
    struct motion *const m = &a->motion;
    const struct homing_view view = {
        .turns = &m->turns,
        .turn = a->tuning.encoder_counts,
        .farthest = farthest(a),
        .at_limit = a->speed.at_limit,
        .index_seen = index_seen(a),
        .index = encoder_index(&a->fabric->encoder),
    };
    modes_control_speed(a, a->tuning.ramp_q16);
    const enum homing_result result = homing_step(&m->homing, &view);
    if (result == HOMING_FAILED) {
        fault_report(a, FAULT_HOMING, whole(m->turns.counts - m->homing.from), 0);
    } else if (result == HOMING_FOUND) {
        finish_homing(a);
    }
}

/* Back at rest once all samples are taken: then pv, at speed 0. */
static void step_learning(struct axis *a)
{
    struct motion *const m = &a->motion;
    cogging_learn_step(&m->learn, &m->turns, &a->speed.estimate, a->torque.torque_q15, &a->tuning);
    a->speed.target_rpm_q16 = cogging_learn_direction(&m->learn) * a->tuning.learn_rpm_q16;
    modes_control_speed(a, a->tuning.ramp_q16);
    if (m->learn.phase == COGGING_DONE) {
        modes_enter(a, AXIS_MODE_SPEED);
    }
}

void modes_step(struct axis *a)
{
    struct motion *const m = &a->motion;
    switch (a->mode) {
    case AXIS_MODE_TORQUE:
        if (!rotor_has_encoder(a) && field_goes_along(a)) {
            break;
        }
        modes_ask(a, a->torque_command_q15);
        if (!rotor_has_encoder(a)) {
            sensorless_after_control(a);
        }
        break;
    case AXIS_MODE_POSITION:
        step_profile(a);
        break;
    case AXIS_MODE_HOMING:
        step_homing(a);
        break;
    case AXIS_MODE_CYCLIC_POSITION:
        control_position(a, cyclic_step(&m->cyclic));
        break;
    case AXIS_MODE_CYCLIC_SPEED:
        control_cyclic_speed(a);
        break;
    case AXIS_MODE_CYCLIC_TORQUE:
        modes_ask(a, (int32_t)(cyclic_step(&m->cyclic) >> 16));
        break;
    case AXIS_MODE_LEARNING:
        step_learning(a);
        break;
    case AXIS_MODE_SPEED:
    default:
        modes_control_speed(a, a->tuning.ramp_q16);
        break;
    }
}
