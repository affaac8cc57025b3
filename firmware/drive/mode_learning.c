/* SPDX-License-Identifier: MIT */
/* `learn cogging`: turns slowly in both directions and samples the torque (commission/learn.h). */
#include <stddef.h>

#include "firmware/axis/axis.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"

static struct outcome learning_check(const struct axis *a, int32_t value)
{
    (void)value;
    if (a->mode == AXIS_MODE_LEARNING) {
        return outcome_of(ERROR_LEARNING);
    }
    return mode_within(a->params.learn_rpm, a->params.speed_max_rpm, ERROR_LEARN_SPEED);
}

static void learning_aim(struct axis *a, const struct set_point *s)
{
    (void)s;
    cogging_learn_begin(&a->motion.learn, &a->motion.turns, &a->tuning);
}

/* When all samples are taken, changes to pv at speed 0. */
static const struct set_point *learning_step(struct axis *a)
{
    static const struct set_point rest = {.mode = AXIS_MODE_SPEED};
    struct motion *const m = &a->motion;
    cogging_learn_step(&m->learn, &m->turns, &a->speed.estimate, a->torque.torque_q15, &a->tuning);
    a->speed.target_rpm_q16 = cogging_learn_direction(&m->learn) * a->tuning.learn_rpm_q16;
    modes_control_speed(a, a->tuning.ramp_q16);
    return m->learn.phase == COGGING_DONE ? &rest : NULL;
}

const struct mode mode_learning = {
    .needs_encoder = true, .check = learning_check, .aim = learning_aim, .step = learning_step};

/* An aborted measurement gives no map. */
void drive_learn(struct axis *a)
{
    struct motion *const m = &a->motion;
    struct cogging_map found;
    if (a->mode == AXIS_MODE_LEARNING && cogging_learn_review(&m->learn, &found)) {
        const uint32_t held = request_hold();
        m->cogging = found;
        a->nvm_cogging.pending = false; /* the stored map is older */
        cogging_set_fade(&m->cogging, a->params.speed_bw_hz);
        request_release(held);
    }
}
