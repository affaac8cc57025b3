/* SPDX-License-Identifier: MIT */
/* pv: a speed, along the ramp. csv: a speed each cycle, in between a straight line. */
#include <stddef.h>

#include "firmware/axis/axis.h"
#include "firmware/settings/scale.h"

static struct outcome pv_check(const struct axis *a, int32_t rpm)
{
    return mode_within(rpm, a->params.speed_max_rpm, ERROR_BEYOND_SPEED_MAX);
}

static void pv_aim(struct axis *a, const struct set_point *s)
{
    a->speed.target_rpm_q16 = s->value * 65536;
}

static const struct set_point *pv_step(struct axis *a)
{
    modes_control_speed(a, a->tuning.ramp_q16);
    return NULL;
}

const struct mode mode_speed = {.check = pv_check, .aim = pv_aim, .step = pv_step};

static void csv_enter(struct axis *a)
{
    cyclic_begin(&a->motion.cyclic, a->speed.ref_rpm_q16);
}

static void csv_aim(struct axis *a, const struct set_point *s)
{
    mode_aim_cyclic(a, s, (int64_t)s->value * 65536);
}

static const struct set_point *csv_step(struct axis *a)
{
    const int32_t now_q16 = (int32_t)cyclic_step(&a->motion.cyclic, a->loop.loops_per_slow);
    const int32_t moved_q16 = scale_clamp(a->motion.cyclic.moved, -INT32_MAX, INT32_MAX);
    struct interval room;
    const int32_t known_q15 = mode_torque_room(a, &room);
    modes_request_torque(a, known_q15 + speed_loop_follow(&a->speed, &a->tuning, now_q16, moved_q16, &room));
    return NULL;
}

const struct mode mode_cyclic_speed = {
    .needs_sensor = true, .check = pv_check, .enter = csv_enter, .aim = csv_aim, .step = csv_step};
