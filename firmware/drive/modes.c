/* SPDX-License-Identifier: MIT */
#include "firmware/drive/modes.h"

#include <stddef.h>

#include "firmware/drive/mode.h"
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

struct outcome modes_check(const struct axis *a, const struct set_point *s)
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
    a->sensorless.ref_rpm_q16 = a->speed.ref_rpm_q16; /* what another mode left is no step of the ramp */
    a->mode = mode;
}

void modes_aim(struct axis *a, const struct set_point *s)
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
