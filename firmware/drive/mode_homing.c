/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "firmware/axis/axis.h"

/* ==== the search ==== */

#define BLOCKED_MS 100u /* a hard stop */
#define STUCK_MS   500u /* stuck while searching the index */

void homing_begin(struct homing *h, enum homing_method method, const struct turns *turns)
{
    *h = (struct homing){.method = (uint32_t)method, .from = turns->counts, .counted = turns->counts};
}

static int64_t homing_size(int64_t x)
{
    return x < 0 ? -x : x;
}

/* A toggle by one count, from an elastic shaft, is not motion. */
static void watch_motion(struct homing *h, const struct homing_view *v)
{
    if (!v->at_limit || homing_size(v->turns->counts - h->counted) > 1) {
        h->counted = v->turns->counts;
        h->blocked_ms = 0;
    } else {
        h->blocked_ms++;
    }
}

enum homing_result homing_step(struct homing *h, const struct homing_view *v)
{
    watch_motion(h, v);
    if (h->method == HOMING_INDEX && v->index_seen) {
        h->zero = turns_at(v->turns, v->index, v->turn);
        return HOMING_FOUND;
    }
    if (h->method == HOMING_BLOCK && h->blocked_ms >= BLOCKED_MS) {
        h->zero = v->turns->counts;
        return HOMING_FOUND;
    }
    const bool too_far = homing_size(v->turns->counts - h->from) > v->farthest;
    return too_far || h->blocked_ms >= STUCK_MS ? HOMING_FAILED : HOMING_SEARCHES;
}

/* ==== the mode ==== */

/* hm: the search for an index or a hard stop (modes.h); then pp holds the zero. */

static struct outcome hm_check(const struct axis *a, int32_t method)
{
    const int32_t rpm = a->params.home_rpm;
    (void)method;
    return rpm == 0 ? (struct outcome){ERROR_HOME_SPEED, a->params.speed_max_rpm}
                    : mode_within(rpm, a->params.speed_max_rpm, ERROR_HOME_SPEED);
}

static void hm_aim(struct axis *a, const struct set_point *s)
{
    encoder_clear(&a->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
    homing_begin(&a->motion.homing, (enum homing_method)s->value, &a->motion.turns);
    a->motion.homed = false;
    a->speed.target_rpm_q16 = a->tuning.home_rpm_q16;
}

static int32_t whole(int64_t counts)
{
    return counts > INT32_MAX ? INT32_MAX : (counts < INT32_MIN ? INT32_MIN : (int32_t)counts);
}

static bool homing_index_seen(const struct axis *a)
{
    return (encoder_status(&a->fabric->encoder) & ENCODER_STATUS_INDEX_SEEN) != 0u;
}

/* Position control moves to the zero and holds it. */
static const struct set_point *hm_finish(struct axis *a)
{
    static const struct set_point zero = {.mode = AXIS_MODE_POSITION};
    struct motion *const m = &a->motion;
    if (m->homing.method == HOMING_BLOCK) {
        speed_loop_reset(&a->speed, 0); /* clears the torque against the stop */
    }
    modes_set_zero(a, m->homing.zero);
    m->homed = true;
    return &zero;
}

/* An index must come within a turn. */
static int64_t farthest(const struct axis *a)
{
    const int64_t turn = a->tuning.encoder_counts;
    return a->motion.homing.method == HOMING_INDEX ? turn + turn / 4 : turn * a->params.home_turns;
}

static const struct set_point *hm_step(struct axis *a)
{
    struct motion *const m = &a->motion;
    const struct homing_view view = {
        .turns = &m->turns,
        .turn = a->tuning.encoder_counts,
        .farthest = farthest(a),
        .at_limit = a->speed.at_limit,
        .index_seen = homing_index_seen(a),
        .index = encoder_index(&a->fabric->encoder),
    };
    modes_control_speed(a, a->tuning.ramp_q16);
    const enum homing_result result = homing_step(&m->homing, &view);
    if (result == HOMING_FAILED) {
        fault_report(a, FAULT_HOMING, axis_forward(a) * whole(m->turns.counts - m->homing.from), 0);
    }
    return result == HOMING_FOUND ? hm_finish(a) : NULL;
}

const struct mode mode_homing = {.needs_encoder = true, .check = hm_check, .aim = hm_aim, .step = hm_step};
