/* SPDX-License-Identifier: MIT */
#include "firmware/control/position.h"

#include "firmware/settings/scale.h"
#include "lib/q15.h"

/* ---- over many turns ---- */

/* Into -turn / 2 ... turn / 2, from less than two turns outside of it. */
static int32_t wrapped(int32_t counts, int32_t turn)
{
    while (counts > turn >> 1) {
        counts -= turn;
    }
    while (counts < -(turn >> 1)) {
        counts += turn;
    }
    return counts;
}

int64_t turns_at(const struct turns *t, uint32_t count, int32_t turn)
{
    return t->counts + wrapped((int32_t)(count - t->count), turn);
}

/* ---- the loop ---- */

#define FAR_MS     4u
#define SLOWEST    16
#define ERROR_MOST (1 << 30)

/* Position within the count, from its lower edge. */
static int64_t within_count(const struct speed_estimate *e, const struct tuning *t)
{
    const int32_t shift = t->profile.shift;
    const int64_t beyond_q32 = (int64_t)e->beyond_q15 * t->counts_per_travel_q16; /* counts */
    return scale_clamp((beyond_q32 >> (32 - shift)) + ((int64_t)e->backwards << shift), 0, 1 << shift);
}

int64_t position_of_shaft(const struct turns *turns, const struct speed_estimate *e, const struct tuning *t,
                          bool moving)
{
    const int64_t edge = turns->counts * (1LL << t->profile.shift);
    return moving ? edge + within_count(e, t) : position_of_counts(turns->counts, t);
}

void position_begin(struct position_loop *p, int64_t ref, int32_t ref_speed)
{
    *p = (struct position_loop){.ref = ref, .ref_speed = ref_speed};
}

/* At rest a count either way is no error: it shows where an edge is, not where the shaft is. */
static int64_t answered(int64_t error, const struct tuning *t)
{
    const int32_t count = 1 << t->profile.shift;
    return error - scale_clamp(error, -count, count);
}

/*
 * With rare edges the speed loop slows down, and this outer loop twice as much, because its feedback is late as well; but it
 * never stops.
 */
static int32_t share_q14(const struct speed_estimate *e)
{
    const int32_t share = speed_loop_share_q14(e);
    return share == 1 << 14 ? share : q15_max(share / 2, (1 << 14) / SLOWEST);
}

/* A change from one way to the other may be farther than 32 bits reach. */
static int32_t rpm_q16(const struct tuning *t, int32_t units)
{
    return scale_clamp(((int64_t)units * t->rpm_per_unit_q20) >> 20, -INT32_MAX, INT32_MAX);
}

int32_t position_step(struct position_loop *p, int64_t next_ref, struct speed_loop *s, const struct turns *turns,
                      const struct tuning *t, const struct interval *limits)
{
    const int32_t next_speed = position_speed(next_ref - p->ref);
    const bool moving = next_speed != 0 || p->ref_speed != 0;
    p->error = p->ref - position_of_shaft(turns, &s->estimate, t, moving);
    p->error_counts = scale_clamp(position_counts(p->error, t), INT32_MIN, INT32_MAX);
    const int32_t most = t->following_units < ERROR_MOST ? (int32_t)t->following_units : ERROR_MOST;
    const int32_t error = scale_clamp(moving ? p->error : answered(p->error, t), -most, most);
    const int32_t gain_q21 = (int32_t)(((int64_t)t->position_gain_q21 * share_q14(&s->estimate)) >> 14);
    const int64_t answer_q16 = ((int64_t)error * gain_q21) >> 21;
    const int32_t most_q16 = t->speed_max_rpm_q4 << 12;
    const int32_t ref_q16 = scale_clamp(rpm_q16(t, p->ref_speed) + answer_q16, -most_q16, most_q16);
    const int32_t moved_q16 = rpm_q16(t, next_speed - p->ref_speed);
    p->ref = next_ref;
    p->ref_speed = next_speed;
    return speed_loop_follow(s, t, ref_q16, moved_q16, limits);
}

bool position_is_lost(struct position_loop *p, const struct tuning *t)
{
    const bool far = p->error > t->following_units || p->error < -t->following_units;
    p->far_ms = far ? p->far_ms + 1u : 0u;
    return p->far_ms >= FAR_MS;
}
