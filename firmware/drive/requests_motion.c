/* SPDX-License-Identifier: MIT */
/*
 * Set-points, each of which selects its mode: checked here, in the thread, and in effect from the next step on. The check and
 * the values it allows to change belong together: a quick stop must not come in between.
 */
#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

struct set_point {
    int32_t value;
    bool relative;
    bool of_encoder; /* meaningless without one */
};

typedef struct outcome (*setter)(struct axis *a, struct set_point s);

static struct outcome set(struct axis *a, setter how, struct set_point s)
{
    if (!request_settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    const uint32_t held = request_hold();
    struct outcome outcome = outcome_of(ERROR_NOT_OPERATING);
    if (a->state == AXIS_OPERATION_ENABLED) {
        outcome = s.of_encoder && !rotor_has_encoder(a) ? outcome_of(ERROR_NEEDS_ENCODER) : how(a, s);
    }
    request_release(held);
    return outcome;
}

static bool beyond(int32_t x, int32_t limit)
{
    return x > limit || x < -limit;
}

/* ---- speed ---- */

static struct outcome set_speed(struct axis *a, struct set_point s)
{
    if (beyond(s.value, a->params.speed_max_rpm)) {
        return outcome_of(ERROR_BEYOND_SPEED_MAX);
    }
    modes_enter(a, AXIS_MODE_SPEED);
    a->speed.target_rpm_q16 = s.value * 65536;
    return OUTCOME_OK;
}

static struct outcome set_cyclic_speed(struct axis *a, struct set_point s)
{
    if (beyond(s.value, a->params.speed_max_rpm)) {
        return outcome_of(ERROR_BEYOND_SPEED_MAX);
    }
    modes_enter(a, AXIS_MODE_CYCLIC_SPEED);
    cyclic_aim(&a->motion.cyclic, (int64_t)s.value * 65536, a->tuning.cyclic_ms);
    return OUTCOME_OK;
}

/* ---- torque ---- */

static int32_t torque_of_milliamp(const struct axis *a, int32_t milliamp)
{
    const int32_t current_q15 = tuning_q15_from_milli(milliamp, a->params.i_range_ma);
    const int32_t torque_q15 = torque_map_reach(&a->torque.map, a->torque.map.current_q15, q15_abs(current_q15));
    return current_q15 < 0 ? -torque_q15 : torque_q15;
}

static struct outcome set_current(struct axis *a, struct set_point s)
{
    if (beyond(s.value, a->params.i_max_ma)) {
        return outcome_of(ERROR_BEYOND_I_MAX);
    }
    a->torque_command_q15 = torque_of_milliamp(a, s.value);
    modes_enter(a, AXIS_MODE_TORQUE);
    return OUTCOME_OK;
}

static struct outcome set_cyclic_current(struct axis *a, struct set_point s)
{
    if (beyond(s.value, a->params.i_max_ma)) {
        return outcome_of(ERROR_BEYOND_I_MAX);
    }
    modes_enter(a, AXIS_MODE_CYCLIC_TORQUE);
    cyclic_aim(&a->motion.cyclic, (int64_t)torque_of_milliamp(a, s.value) * 65536, a->tuning.cyclic_ms);
    return OUTCOME_OK;
}

/* ---- position ---- */

static struct outcome set_position(struct axis *a, struct set_point s)
{
    const bool goes_on = a->mode == AXIS_MODE_POSITION;
    const int64_t from = goes_on ? position_counts(a->motion.profile.target, &a->tuning) : a->motion.turns.counts;
    modes_enter(a, AXIS_MODE_POSITION);
    profile_aim(&a->motion.profile, position_of_counts((s.relative ? from : 0) + s.value, &a->tuning));
    return OUTCOME_OK;
}

/* A set-point may be no farther than the largest speed reaches before the next one is due. */
static struct outcome set_cyclic_position(struct axis *a, struct set_point s)
{
    const struct tuning *const t = &a->tuning;
    const bool goes_on = a->mode == AXIS_MODE_CYCLIC_POSITION;
    const int64_t here = goes_on ? position_counts(a->motion.cyclic.now, t) : a->motion.turns.counts;
    const int64_t most = (int64_t)a->params.speed_max_rpm * t->encoder_counts * t->cyclic_ms / 60000;
    if (s.value - here > most || s.value - here < -most) {
        return (struct outcome){ERROR_BEYOND_CYCLE, (int32_t)(most > INT32_MAX ? INT32_MAX : most)};
    }
    modes_enter(a, AXIS_MODE_CYCLIC_POSITION);
    cyclic_aim(&a->motion.cyclic, position_of_counts(s.value, t), t->cyclic_ms);
    return OUTCOME_OK;
}

static struct outcome set_home(struct axis *a, struct set_point s)
{
    const int32_t rpm = a->params.home_rpm;
    if (rpm == 0 || beyond(rpm, a->params.speed_max_rpm)) {
        return outcome_of(ERROR_HOME_SPEED);
    }
    encoder_clear(&a->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
    homing_begin(&a->motion.homing, (enum homing_method)s.value, &a->motion.turns);
    modes_enter(a, AXIS_MODE_HOMING);
    a->motion.homed = false;
    a->speed.target_rpm_q16 = a->tuning.home_rpm_q16;
    return OUTCOME_OK;
}

static struct outcome set_learning(struct axis *a, struct set_point s)
{
    (void)s;
    if (a->mode == AXIS_MODE_LEARNING) {
        return outcome_of(ERROR_LEARNING);
    }
    if (a->params.learn_rpm > a->params.speed_max_rpm) {
        return outcome_of(ERROR_LEARN_SPEED);
    }
    modes_enter(a, AXIS_MODE_LEARNING);
    cogging_learn_begin(&a->motion.learn, &a->motion.turns, &a->tuning);
    return OUTCOME_OK;
}

struct outcome drive_learn_cogging(struct axis *a)
{
    return set(a, set_learning, (struct set_point){.of_encoder = true});
}

/* Learning that was stopped gives no map. */
void drive_learn(struct axis *a)
{
    struct motion *const m = &a->motion;
    struct cogging_map found;
    if (a->mode == AXIS_MODE_LEARNING && cogging_learn_review(&m->learn, &found)) {
        const uint32_t held = request_hold();
        m->cogging = found;
        a->keeping.waits = false; /* what was stored is older */
        cogging_set_fade(&m->cogging, a->params.speed_bw_hz);
        request_release(held);
    }
}

struct outcome drive_command_speed(struct axis *a, int32_t rpm)
{
    return set(a, set_speed, (struct set_point){.value = rpm});
}

struct outcome drive_command_current(struct axis *a, int32_t milliamp)
{
    return set(a, set_current, (struct set_point){.value = milliamp});
}

struct outcome drive_command_position(struct axis *a, int32_t counts, bool relative)
{
    return set(a, set_position, (struct set_point){counts, relative, true});
}

struct outcome drive_command_cyclic_position(struct axis *a, int32_t counts)
{
    return set(a, set_cyclic_position, (struct set_point){counts, false, true});
}

struct outcome drive_command_cyclic_speed(struct axis *a, int32_t rpm)
{
    return set(a, set_cyclic_speed, (struct set_point){.value = rpm});
}

struct outcome drive_command_cyclic_current(struct axis *a, int32_t milliamp)
{
    return set(a, set_cyclic_current, (struct set_point){.value = milliamp});
}

struct outcome drive_command_home(struct axis *a, enum homing_method method)
{
    return set(a, set_home, (struct set_point){(int32_t)method, false, true});
}

struct outcome drive_set_zero(struct axis *a)
{
    if (!request_settled(a)) {
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
