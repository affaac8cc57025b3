/* SPDX-License-Identifier: MIT */
/* pp: a position, by a profile. csp: a position each cycle, in between a straight line. */
#include <stddef.h>

#include "firmware/axis/axis.h"
#include "lib/q15.h"

/* The present reference speed, in the profile's units. A 64-bit division. */
static int32_t units_of_rpm_q16(const struct tuning *t, int32_t rpm_q16)
{
    return position_speed((int64_t)rpm_q16 * (1 << 20) / t->rpm_per_unit_q20);
}

/* The shaft's position at the next step, at the speed loop's reference speed. */
static void begin_position(struct axis *a)
{
    struct motion *const m = &a->motion;
    const int32_t speed = units_of_rpm_q16(&a->tuning, a->speed.ref_rpm_q16);
    const int64_t here = position_of_shaft(&m->turns, &a->speed.estimate, &a->tuning, speed != 0);
    position_begin(&m->position, here + speed, speed);
}

static void control_position(struct axis *a, int64_t next_ref)
{
    struct motion *const m = &a->motion;
    struct interval room;
    const int32_t known_q15 = mode_torque_room(a, &room);
    modes_request_torque(a, known_q15 + position_step(&m->position, next_ref, &a->speed, &m->turns, &a->tuning, &room));
    if (position_is_lost(&m->position, &a->tuning)) {
        fault_report(a, FAULT_FOLLOWING_ERROR, axis_forward(a) * m->position.error_counts, 0);
    }
}

void modes_set_zero(struct axis *a, int64_t counts)
{
    struct motion *const m = &a->motion;
    const int64_t by = -counts * (1LL << a->tuning.profile.shift);
    m->turns.counts -= counts;
    m->position.ref += by;
    profile_shift(&m->profile, by);
    if (a->mode == AXIS_MODE_CYCLIC_POSITION) {
        m->cyclic.now += by;
        m->cyclic.target += by;
    }
}

static struct outcome pp_check(const struct axis *a, int32_t counts)
{
    (void)a;
    (void)counts;
    return OUTCOME_OK;
}

static void pp_enter(struct axis *a)
{
    struct motion *const m = &a->motion;
    if (!axis_mode_is_position(a->mode)) {
        begin_position(a);
    }
    profile_begin(&m->profile, &a->tuning.profile, m->position.ref, m->position.ref_speed);
    m->aimed = false;
}

/* A relative one counts from the last target, the first from the shaft; no sum of them is farther than nine years away. */
static void pp_aim(struct axis *a, const struct set_point *s)
{
    struct motion *const m = &a->motion;
    const int64_t here = position_counts(m->profile.position, &a->tuning);
    const int64_t most = PROFILE_FARTHEST >> a->tuning.profile.shift;
    const int64_t last = m->aimed ? position_counts(m->profile.target, &a->tuning) : m->turns.counts;
    const int64_t way = (s->relative ? last : turns_nearest(here, s->value)) + s->by - here;
    m->aimed = true;
    profile_aim(&m->profile, position_of_counts(here + (way > most ? most : way < -most ? -most : way), &a->tuning));
}

/* What of a speed is in the direction of another one, at most the other. */
static int32_t along(int32_t speed, int32_t other)
{
    return other < 0 ? q15_clamp(speed, other, 0) : q15_clamp(speed, 0, other);
}

/*
 * The profile keeps within following_mturn of the shaft, and the count more that makes it a fault: it waits for a shaft that is
 * held, and goes on from where one that is slow or driven away has come to.
 */
static void wait_for_shaft(struct axis *a)
{
    struct profile *const p = &a->motion.profile;
    const struct tuning *const t = &a->tuning;
    const int64_t most = t->following_units + (1LL << t->profile.shift);
    const int32_t shaft_speed = units_of_rpm_q16(t, a->speed.estimate.speed_rpm_q15 * 2);
    const int64_t shaft = position_of_shaft(&a->motion.turns, &a->speed.estimate, t, true) + shaft_speed;
    const int64_t ahead = p->position - shaft; /* at the next step, both */
    if (ahead <= most && ahead >= -most) {
        return;
    }
    const int64_t target = p->target;
    const int32_t speed = along(along(shaft_speed, p->speed), p->corner_speed);
    profile_begin(p, &t->profile, shaft + (ahead < 0 ? -most : most), speed);
    profile_aim(p, target);
}

static const struct set_point *pp_step(struct axis *a)
{
    profile_step(&a->motion.profile, &a->tuning.profile);
    wait_for_shaft(a);
    control_position(a, a->motion.profile.position);
    return NULL;
}

const struct mode mode_position = {
    .needs_encoder = true, .check = pp_check, .enter = pp_enter, .aim = pp_aim, .step = pp_step};

/* Of 32 bits that wrap. */
static bool beyond(int64_t to, int64_t from, int32_t most)
{
    const int32_t way = (int32_t)((uint32_t)to - (uint32_t)from);
    return way > most || way < -most;
}

/*
 * A set-point may be no farther from the one before than the largest speed reaches before the next one is due; and, where they
 * come more often than that, no farther than twice that from where the shaft is to be.
 */
static struct outcome csp_check(const struct axis *a, int32_t counts)
{
    const struct tuning *const t = &a->tuning;
    const bool continues = a->mode == AXIS_MODE_CYCLIC_POSITION;
    const int64_t here = continues ? position_counts(a->motion.cyclic.now, t) : a->motion.turns.counts;
    const struct set_point *const waiting = &a->set_point;
    const int64_t before = waiting->waits && waiting->mode == AXIS_MODE_CYCLIC_POSITION
                               ? (waiting->second ? waiting->first : waiting->value)
                           : continues ? position_counts(a->motion.cyclic.target, t)
                                       : here;
    const int32_t most = (int32_t)((int64_t)a->params.speed_max_rpm * t->encoder_counts * t->cyclic_ms / 60000);
    if (beyond(counts, before, most) || beyond(counts, here, 2 * most)) {
        return (struct outcome){ERROR_BEYOND_CYCLE, most};
    }
    return OUTCOME_OK;
}

static void csp_enter(struct axis *a)
{
    if (!axis_mode_is_position(a->mode)) {
        begin_position(a);
    }
    cyclic_begin(&a->motion.cyclic, a->motion.position.ref);
}

static void csp_aim(struct axis *a, const struct set_point *s)
{
    const int64_t before = position_counts(a->motion.cyclic.target, &a->tuning);
    mode_aim_cyclic(a, s, position_of_counts(turns_nearest(before, s->value), &a->tuning));
}

static const struct set_point *csp_step(struct axis *a)
{
    control_position(a, cyclic_step(&a->motion.cyclic, a->loop.loops_per_slow));
    return NULL;
}

const struct mode mode_cyclic_position = {
    .needs_encoder = true, .check = csp_check, .enter = csp_enter, .aim = csp_aim, .step = csp_step};
