/* SPDX-License-Identifier: MIT */
#include "firmware/drive/modes.h"

#include <stddef.h>

#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"
#include "firmware/settings/features.h"
#include "firmware/source/rotor.h"

static const struct mode *const modes_table[AXIS_MODES] = {
    [AXIS_MODE_SPEED] = &mode_speed,
    [AXIS_MODE_TORQUE] = &mode_torque,
    [AXIS_MODE_POSITION] = FEATURE_IN(POSITION) ? &mode_position : NULL,
    [AXIS_MODE_HOMING] = FEATURE_IN(POSITION) ? &mode_homing : NULL,
    [AXIS_MODE_CYCLIC_POSITION] = FEATURE_IN(POSITION) ? &mode_cyclic_position : NULL,
    [AXIS_MODE_CYCLIC_SPEED] = &mode_cyclic_speed,
    [AXIS_MODE_CYCLIC_TORQUE] = &mode_cyclic_torque,
    [AXIS_MODE_LEARNING] = FEATURE_IN(LEARN) ? &mode_learning : NULL,
};

struct outcome modes_available(const struct axis *a, uint32_t mode)
{
    const struct mode *const m = modes_table[mode];
    if (m == NULL) {
        return feature_absent(mode == AXIS_MODE_LEARNING ? FEATURE_LEARN : FEATURE_POSITION);
    }
    if (m->needs_sensor && rotor_is_sensorless(a)) {
        return outcome_of(ERROR_NEEDS_SENSOR);
    }
    return m->needs_encoder && !rotor_has_encoder(a) ? outcome_of(ERROR_NEEDS_ENCODER) : OUTCOME_OK;
}

/* Whether a set-point is allowed now. Slow loop held. Thread. */
static struct outcome modes_check(const struct axis *a, const struct set_point *s)
{
    const struct outcome available = modes_available(a, s->mode);
    return available.error != ERROR_NONE ? available : modes_table[s->mode]->check(a, s->value);
}

void modes_enter(struct axis *a, enum axis_mode mode)
{
    if (a->mode == (uint32_t)mode) {
        return;
    }
    if (axis_mode_is_torque(a->mode) && !axis_mode_is_torque(mode)) {
        speed_loop_reset(&a->speed, a->torque.torque_q15);
    }
    if (modes_table[mode]->enter != NULL) {
        modes_table[mode]->enter(a);
    }
    a->sensorless.ref_rpm_q16 = a->speed.ref_rpm_q16; /* no step of the ramp at a change of mode */
    a->mode = mode;
}

/* Enters a set-point's mode and applies it. Slow loop, in operation. */
static void modes_aim(struct axis *a, const struct set_point *s)
{
    modes_enter(a, (enum axis_mode)s->mode);
    modes_table[s->mode]->aim(a, s);
}

void modes_step(struct axis *a)
{
    const struct set_point *const next = modes_table[a->mode]->step(a);
    if (next != NULL) {
        modes_aim(a, next);
    }
}

/* ==== set-points ==== */

static void leave_in_mailbox(struct axis *a, struct set_point *s)
{
    const struct set_point *const before = &a->set_point;
    if (s->relative && before->waits && before->mode == s->mode) {
        s->by += before->by; /* two relative ones within a step add up */
        s->value = before->value;
        s->relative = before->relative;
    }
    s->at = adc_sequence(&a->fabric->adc);
    if (before->waits && before->mode == s->mode && axis_mode_is_cyclic(s->mode)) {
        s->second = true;
        s->first = before->second ? before->first : before->value; /* of three, the second is dropped */
        s->first_at = before->second ? before->first_at : before->at;
    }
    s->waits = true;
    a->set_point = *s;
}

/* Check and mailbox are one masked section, so that a quick stop cannot come in between. Thread. */
static struct outcome post(struct axis *a, struct set_point *s)
{
    if (!request_settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    const uint32_t held = request_hold();
    const struct outcome outcome =
        a->state == AXIS_OPERATION_ENABLED ? modes_check(a, s) : outcome_of(ERROR_NOT_OPERATING);
    if (outcome.error == ERROR_NONE) {
        leave_in_mailbox(a, s);
    }
    request_release(held);
    return outcome;
}

static void aim(struct axis *a, const struct set_point *s)
{
    if (modes_check(a, s).error == ERROR_NONE) { /* a failover may have removed the encoder since */
        modes_aim(a, s);
    }
}

void set_point_take(struct axis *a)
{
    const struct set_point s = a->set_point;
    a->set_point.waits = false;
    if (s.waits && s.second) {
        aim(a, &(struct set_point){.mode = s.mode, .value = s.first, .at = s.first_at});
    }
    if (s.waits) {
        aim(a, &s);
    }
}

/* An operator's value in the machine's direction. INT32_MIN is its own negative, as in any wrapping counter. */
static int32_t turned(const struct axis *a, int32_t value)
{
    return axis_forward(a) < 0 ? (int32_t)(0u - (uint32_t)value) : value;
}

static struct outcome post_value(struct axis *a, enum axis_mode mode, int32_t value)
{
    return post(a, &(struct set_point){.mode = (uint8_t)mode, .value = turned(a, value)});
}

struct outcome drive_command_speed(struct axis *a, int32_t rpm)
{
    return post_value(a, AXIS_MODE_SPEED, rpm);
}

struct outcome drive_command_current(struct axis *a, int32_t milliamp)
{
    return post_value(a, AXIS_MODE_TORQUE, milliamp);
}

struct outcome drive_command_position(struct axis *a, int32_t counts, bool relative)
{
    return post(a, &(struct set_point){.mode = AXIS_MODE_POSITION,
                                       .value = relative ? 0 : turned(a, counts),
                                       .relative = relative,
                                       .by = relative ? turned(a, counts) : 0});
}

struct outcome drive_command_cyclic_position(struct axis *a, int32_t counts)
{
    return post_value(a, AXIS_MODE_CYCLIC_POSITION, counts);
}

struct outcome drive_command_cyclic_speed(struct axis *a, int32_t rpm)
{
    return post_value(a, AXIS_MODE_CYCLIC_SPEED, rpm);
}

struct outcome drive_command_cyclic_current(struct axis *a, int32_t milliamp)
{
    return post_value(a, AXIS_MODE_CYCLIC_TORQUE, milliamp);
}

struct outcome drive_command_home(struct axis *a, enum homing_method method)
{
    return post(a, &(struct set_point){.mode = AXIS_MODE_HOMING, .value = (int32_t)method});
}

struct outcome drive_learn_cogging(struct axis *a)
{
    return post(a, &(struct set_point){.mode = AXIS_MODE_LEARNING});
}

/* Earlier set-points refer to the old zero and must be taken first. */
static bool set_point_is_taken(const struct axis *a)
{
    for (uint32_t poll = 0; poll < REQUEST_TIMEOUT_POLLS; poll++) {
        if (!a->set_point.waits) {
            return true;
        }
    }
    return false;
}

struct outcome drive_set_zero(struct axis *a)
{
    if (!FEATURE_IN(POSITION)) {
        return feature_absent(FEATURE_POSITION);
    }
    if (!request_settled(a) || !set_point_is_taken(a)) {
        return outcome_of(ERROR_BUSY);
    }
    const uint32_t held = request_hold();
    const bool searching = a->state == AXIS_OPERATION_ENABLED && a->mode == AXIS_MODE_HOMING;
    if (!searching) {
        modes_set_zero(a, a->motion.turns.counts);
        a->motion.homed = false;
    }
    request_release(held);
    return outcome_of(searching ? ERROR_HOMING : ERROR_NONE);
}
