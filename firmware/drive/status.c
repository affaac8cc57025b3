/* SPDX-License-Identifier: MIT */
/* What a running axis shows to others. */
#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"

static int64_t target(const struct axis *a)
{
    return a->mode == AXIS_MODE_CYCLIC_POSITION ? a->motion.cyclic.target : a->motion.profile.target;
}

static struct drive_status status_look(const struct axis *a)
{
    const volatile struct current_loop *const loop = &a->loop;
    const int32_t forward = axis_forward(a);
    return (struct drive_status){
        .state = a->state,
        .fault = a->faults.cause,
        .speed_rpm_q4 = forward * a->speed.speed_rpm_q4,
        .speed_ref_rpm_q4 = forward * a->speed.speed_ref_rpm_q4,
        .up_ms = axis_up_ms(a),
        .mode = a->mode,
        .homed = a->motion.homed,
        .position = (int32_t)(forward * a->motion.turns.counts),
        .target = (int32_t)(forward * position_counts(target(a), &a->tuning)),
        .error_counts = forward * a->motion.position.error_counts,
        .i_d_q15 = loop->i_d_q15,
        .i_q_q15 = forward * loop->i_q_q15,
        .i_d_ref_q15 = loop->i_d_ref_q15,
        .i_q_ref_q15 = forward * loop->i_q_ref_q15,
        .vbus_q15 = loop->vbus_q15,
    };
}

/* Changes with each sample; a fabric in doubt is not sampled. */
static uint32_t sample(const struct axis *a)
{
    return axis_fabric_doubted(a) ? 0u : adc_sequence(&a->fabric->adc);
}

/* The slow loop is held off, the current loop is not: what it interrupts is read again. */
struct drive_status drive_status(const struct axis *a)
{
    struct drive_status status;
    uint32_t before;
    const uint32_t held = request_hold();
    do {
        before = sample(a);
        status = status_look(a);
    } while (sample(a) != before);
    request_release(held);
    return status;
}
