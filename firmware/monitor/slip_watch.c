/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/slip_watch.h"

#include "lib/advance.h"
#include "lib/q15.h"

#define MEAN_SHIFT  3 /* steps remembered, by the EMF's filter: 16, up to 128 */
#define LEAST_SHIFT 5 /* a 32nd of the bus: less EMF tells nothing */
#define DEAD_SHIFT  8 /* of the bus: what the dead time changes by */
#define SAME_SHIFT  2 /* a quarter more or less current, and of speed half of that, is the same */
#define NOISE_SHIFT 5 /* and a 32nd of i_max */
#define ELSEWHERE   8 /* steps: a count that was lost kicks speed and currents for less */
#define STEPS       3
#define LARGEST_Q15 131071

struct slip_view {
    int32_t i_d_q15, i_q_q15, w_q15;
    int32_t i_d_ref_q15, i_q_ref_q15;
    int32_t v_d_q15; /* in the rotor's frame at the sample */
};

static struct slip_view point_now(const volatile struct current_loop *c)
{
    int32_t v_d_q15 = c->v_d_q15;
    int32_t v_q_q15 = c->v_q_q15;
    advance_q15(&v_d_q15, &v_q_q15, -c->v_turn_q15);
    return (struct slip_view){.i_d_q15 = c->i_d_q15,
                              .i_q_q15 = c->i_q_q15,
                              .w_q15 = current_loop_w_q15(c),
                              .i_d_ref_q15 = c->i_d_ref_q15,
                              .i_q_ref_q15 = c->i_q_ref_q15,
                              .v_d_q15 = v_d_q15};
}

static bool is_same(int32_t now, int32_t then, int32_t shift, int32_t noise)
{
    return q15_abs(now - then) <= (q15_abs(then) >> shift) + noise;
}

static bool at_same_point(const struct slip_watch *s, const struct slip_view *v, const struct tuning *t)
{
    const int32_t noise_q15 = t->i_max_q15 >> NOISE_SHIFT;
    return is_same(v->w_q15, s->w_q15, SAME_SHIFT + 1, 0) &&
           is_same(v->i_d_ref_q15, s->i_d_q15, SAME_SHIFT, noise_q15) &&
           is_same(v->i_q_ref_q15, s->i_q_q15, SAME_SHIFT, noise_q15);
}

/* A count that was lost turns the frame, too: for some milliseconds the current is not what is asked for. */
static bool is_kicked(const struct slip_view *v, const struct tuning *t)
{
    const int32_t noise_q15 = t->i_max_q15 >> NOISE_SHIFT;
    return !is_same(v->i_q_q15, v->i_q_ref_q15, SAME_SHIFT, noise_q15);
}

/* w Lq i_q at the Lq that was known. */
static int32_t reaction_q15(const struct slip_watch *s, int32_t w_q15, int32_t i_q_q15)
{
    const int64_t reaction = ((int64_t)((w_q15 * i_q_q15) >> 15) * (s->lq_q19 >> 8)) >> 11;
    return reaction > LARGEST_Q15 ? LARGEST_Q15 : (reaction < -LARGEST_Q15 ? -LARGEST_Q15 : (int32_t)reaction);
}

static int32_t across_q15(const struct slip_watch *s, const struct slip_view *v, const struct tuning *t)
{
    return v->v_d_q15 - ((t->r_q12 * v->i_d_q15) >> 12) + reaction_q15(s, v->w_q15, v->i_q_q15);
}

/* 11 degrees of the EMF, and what may be unknown of a change: half of the reaction's, half of the resistance. */
static int32_t allowed_q15(const struct slip_watch *s, const struct slip_view *v, const struct emf *e,
                           const struct tuning *t, int32_t vbus_q15)
{
    const int32_t length_q15 = q15_max(q15_abs(e->filtered.q_q15), e->expected_q15 / 2);
    const int32_t reaction = q15_abs(reaction_q15(s, v->w_q15, v->i_q_q15) - reaction_q15(s, s->w_q15, s->i_q_q15));
    const int32_t i_d_q15 = q15_abs(v->i_d_q15 - s->i_d_q15) + q15_abs(v->i_d_q15) / 2;
    return (int32_t)(((int64_t)length_q15 * e->turned_q15) >> 17) * 3 + reaction / 2 + ((t->r_q12 * i_d_q15) >> 12) +
           (vbus_q15 >> DEAD_SHIFT) + e->moving_q15;
}

static void begin_at(struct slip_watch *s, const struct slip_view *v, const struct emf *e, const struct tuning *t)
{
    *s = (struct slip_watch){
        .i_d_q15 = v->i_d_ref_q15, .i_q_q15 = v->i_q_ref_q15, .w_q15 = v->w_q15, .lq_q19 = e->lq_q19, .steps = 1};
    s->across_q15 = across_q15(s, v, t);
}

bool slip_watch_step(struct slip_watch *s, const struct emf *e, const volatile struct current_loop *c,
                     const struct tuning *t)
{
    const struct slip_view v = point_now(c);
    const int32_t steps_shift = MEAN_SHIFT + (int32_t)e->filter_shift;
    if (e->expected_q15 <= c->vbus_q15 >> LEAST_SHIFT) {
        s->steps = 0;
        return false;
    }
    const bool same = at_same_point(s, &v, t) && !is_kicked(&v, t);
    s->elsewhere = same ? 0 : s->elsewhere + 1;
    if (s->steps == 0 || s->elsewhere >= ELSEWHERE) {
        begin_at(s, &v, e, t);
        return false;
    }
    if (!same) {
        return false;
    }
    const int32_t now_q15 = across_q15(s, &v, t);
    if (s->steps < 1 << steps_shift) {
        s->across_q15 += now_q15;
        s->steps++;
        s->across_q15 >>= s->steps == 1 << steps_shift ? steps_shift : 0;
        return false;
    }
    s->changed_q15 += (now_q15 - s->across_q15 - s->changed_q15) >> e->filter_shift;
    const bool against = q15_abs(s->changed_q15) > allowed_q15(s, &v, e, t, c->vbus_q15);
    s->against = against ? s->against + 1 : q15_max(s->against - 1, 0);
    return s->against >= STEPS;
}
