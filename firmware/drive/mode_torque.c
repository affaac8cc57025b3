/* SPDX-License-Identifier: MIT */
/* tq: profile torque, without a ramp. cst: cyclic synchronous torque, interpolated linearly. */
#include <stddef.h>

#include "firmware/axis/axis.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

static struct outcome tq_check(const struct axis *a, int32_t milliamp)
{
    return mode_within(milliamp, a->params.i_max_ma, ERROR_BEYOND_I_MAX);
}

static int32_t torque_of_milliamp(const struct axis *a, int32_t milliamp)
{
    const int32_t current_q15 = tuning_q15_from_milli(milliamp, a->params.i_range_ma);
    const int32_t torque_q15 = torque_map_reach(&a->torque.map, a->torque.map.current_q15, q15_abs(current_q15));
    return current_q15 < 0 ? -torque_q15 : torque_q15;
}

static void tq_aim(struct axis *a, const struct set_point *s)
{
    a->torque_command_q15 = torque_of_milliamp(a, s->value);
}

/* I-f control has no torque control: the field accelerates in the torque's direction until the observer takes over. */
static bool field_goes_along(struct axis *a)
{
    const int32_t far_rpm = a->torque_command_q15 == 0 ? 0 : a->params.speed_max_rpm;
    if (rotor_is_known(a)) {
        return false;
    }
    a->speed.target_rpm_q16 = (a->torque_command_q15 < 0 ? -far_rpm : far_rpm) * 65536;
    return sensorless_lead_field(a, a->tuning.ramp_q16);
}

static const struct set_point *tq_step(struct axis *a)
{
    if (rotor_is_sensorless(a) && field_goes_along(a)) {
        return NULL;
    }
    modes_request_torque(a, a->torque_command_q15);
    if (rotor_is_sensorless(a)) {
        sensorless_after_control(a);
    }
    return NULL;
}

const struct mode mode_torque = {.check = tq_check, .aim = tq_aim, .step = tq_step};

static void cst_enter(struct axis *a)
{
    cyclic_begin(&a->motion.cyclic, (int64_t)a->torque.torque_q15 * 65536);
}

static void cst_aim(struct axis *a, const struct set_point *s)
{
    mode_aim_cyclic(a, s, (int64_t)torque_of_milliamp(a, s->value) * 65536);
}

static const struct set_point *cst_step(struct axis *a)
{
    modes_request_torque(a, (int32_t)(cyclic_step(&a->motion.cyclic, a->loop.loops_per_slow) >> 16));
    return NULL;
}

const struct mode mode_cyclic_torque = {
    .needs_sensor = true, .check = tq_check, .enter = cst_enter, .aim = cst_aim, .step = cst_step};
