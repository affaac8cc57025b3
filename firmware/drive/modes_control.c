/* SPDX-License-Identifier: MIT */
/* Common to the modes: torque limits and speed control. Slow loop. */
#include "firmware/axis/axis.h"
#include "firmware/settings/scale.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

#define FRICTION_POSITION_SHIFT 2

/* Homing has a lower limit, to protect the machine at a hard stop. */
static int32_t i_limit_q15(const struct axis *a)
{
    const int32_t max_q15 = thermal_i_limit_q15(&a->thermal, a->tuning.i_max_q15);
    return a->mode == AXIS_MODE_HOMING ? q15_min(max_q15, a->tuning.home_i_q15) : max_q15;
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

void mode_aim_cyclic(struct axis *a, const struct set_point *s, int64_t target)
{
    struct cyclic *const c = &a->motion.cyclic;
    const int32_t step = a->loop.loops_per_slow;
    const int32_t period = a->tuning.cyclic_ms * step;
    const int32_t age = (int32_t)(a->heartbeat - cyclic_due(c, s->at, period, step));
    cyclic_aim(c, target, period, step - q15_max(0, q15_min(age, step)));
}

void modes_request_torque(struct axis *a, int32_t torque_q15)
{
    torque_ask(&a->torque, &a->loop, &a->tuning, torque_q15);
}

/*
 * Feeds forward Coulomb friction for the commanded direction, so that the integral need not build it up again at each reversal
 * while the shaft is at rest.
 *
 * It uses the reference, not the speed: with the speed, a friction set too large would drive the shaft. Near 0 it is
 * proportional to the reference, with the speed loop's own gain; a quarter of that if a position loop sets the reference,
 * because it adds that much stiffness to the loop. At most t->friction_q15, in the reference's direction.
 */
static int32_t friction_torque_q15(const struct speed_loop *s, const struct tuning *t, bool position)
{
    const int32_t slope_q16 = (int32_t)(((int64_t)s->kp_q16 * speed_loop_share_q14(&s->estimate)) >> 14);
    const int64_t answer_q15 = ((int64_t)s->ref_rpm_q16 * slope_q16) >> (28 + (position ? FRICTION_POSITION_SHIFT : 0));
    return scale_clamp(answer_q15, -t->friction_q15, t->friction_q15);
}

int32_t modes_feedforward_torque_q15(struct axis *a)
{
    struct motion *const m = &a->motion;
    if (a->tuning.friction_q15 == 0 && m->cogging.count == 0) {
        return 0;
    }
    const int32_t friction_q15 = friction_torque_q15(&a->speed, &a->tuning, axis_mode_is_position(a->mode));
    if (!FEATURE_IN(LEARN) || m->cogging.count == 0) {
        return friction_q15;
    }
    m->cogging_q15 = cogging_torque_q15(&m->cogging, &a->speed.estimate, &a->tuning);
    return m->cogging_q15 + friction_q15;
}

/*
 * Torque limits for the speed loop on top of the feed-forward torque for cogging and friction, which is returned. torque_ask()
 * limits the total.
 */
int32_t mode_torque_room(struct axis *a, struct interval *room)
{
    *room = a->torque.limits;
    a->speed.torque_is_slow = a->torque.flux.decides;
    if (!rotor_has_encoder(a)) {
        return 0;
    }
    const int32_t known_q15 = modes_feedforward_torque_q15(a);
    room->low -= known_q15;
    room->high -= known_q15;
    return known_q15;
}

void modes_control_speed(struct axis *a, int32_t slope_q16)
{
    if (rotor_is_sensorless(a) && sensorless_lead_field(a, slope_q16)) {
        return;
    }
    struct interval room;
    const int32_t known_q15 = mode_torque_room(a, &room);
    modes_request_torque(a, known_q15 + speed_loop_step(&a->speed, &a->tuning, slope_q16, &room));
    if (rotor_is_sensorless(a)) {
        sensorless_after_control(a);
    }
}
