/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/field_watch.h"

#include "firmware/axis/axis.h"
#include "lib/advance.h"
#include "lib/q15.h"

#define FILTER_SHIFT 2 /* 4 ms: the noise of the voltages */
#define LEAST_SHIFT  6 /* a 64th of the bus: less EMF tells nothing */
#define MISSING      2 /* points a millisecond, */
#define OPPOSITE     4
#define THERE        (-1)

void field_watch_reset(struct field_watch *w)
{
    *w = (struct field_watch){0};
}

struct field_view {
    int32_t d_q15, q_q15; /* e; q along the field's speed */
    int32_t expected_q15, doubt_q15;
};

static struct field_view field_watch_look(const struct axis *a)
{
    const struct tuning *const t = &a->tuning;
    const volatile struct current_loop *const c = &a->loop;
    const int32_t w_q15 = q15_sat16(c->field_speed_q32 >> c->w_shift);
    int32_t v_d_q15 = c->v_d_q15;
    int32_t v_q_q15 = c->v_q_q15;
    advance_q15(&v_d_q15, &v_q_q15, -c->v_turn_q15);
    const int32_t armature_q15 = tuning_reactive_q15(w_q15, c->i_d_q15, t->x_q_apparent_q11);
    const int32_t q_q15 = v_q_q15 - ((t->r_q12 * c->i_q_q15) >> 12) - armature_q15;
    const int32_t drop_q15 = (t->r_q12 * c->i_d_q15) >> 12;
    return (struct field_view){
        .d_q15 = v_d_q15 - drop_q15,
        .q_q15 = w_q15 < 0 ? -q_q15 : q_q15,
        .expected_q15 = (q15_abs(w_q15) * t->emf_q12) >> 12,
        .doubt_q15 = ((q15_abs(drop_q15) * OBSERVER_DOUBT_R_Q8) >> 8) + (c->vbus_q15 >> OBSERVER_DOUBT_BUS_SHIFT),
    };
}

static int32_t filtered(int32_t mean_q4, int32_t now_q15)
{
    return mean_q4 + ((now_q15 * 16 - mean_q4) >> FILTER_SHIFT);
}

/* This millisecond's vote: does either component fit a rotor that follows? */
static int32_t points(const struct field_watch *w, const struct field_view *v)
{
    if (w->q_q4 * 2 < -w->expected_q4) {
        return OPPOSITE;
    }
    const bool missing = w->q_q4 * 4 < w->expected_q4 && q15_abs(w->d_q4) < w->expected_q4 / 2 + v->doubt_q15 * 16;
    return missing ? MISSING : THERE;
}

/* Twice the EMF of the field's speed, and several times what may be hidden: something else turns the rotor. */
static bool is_away(const struct field_view *v, int32_t vbus_q15)
{
    const int32_t seen_q15 = q15_max(q15_abs(v->d_q15), q15_abs(v->q_q15));
    return seen_q15 > 2 * v->expected_q15 + 3 * v->doubt_q15 + (vbus_q15 >> LEAST_SHIFT);
}

void field_watch_step(struct axis *a)
{
    struct field_watch *const w = &a->field_watch;
    const struct field_view v = field_watch_look(a);
    const bool tells = v.expected_q15 > a->loop.vbus_q15 >> LEAST_SHIFT;
    if (!tells) {
        w->d_q4 = 0;
        w->q_q4 = 0;
        w->expected_q4 = 0;
    } else {
        w->d_q4 = filtered(w->d_q4, v.d_q15);
        w->q_q4 = filtered(w->q_q4, v.q_q15);
        w->expected_q4 = filtered(w->expected_q4, v.expected_q15);
    }
    const int32_t now = is_away(&v, a->loop.vbus_q15) ? MISSING : tells ? points(w, &v) : THERE;
    w->out = q15_max(w->out + now, 0);
    if (w->out >= FIELD_WATCH_POINTS) {
        const int32_t percent = scale_clamp(100LL * w->q_q4 / q15_max(w->expected_q4, 1), INT32_MIN, INT32_MAX);
        fault_report(a, FAULT_OUT_OF_STEP, percent, a->loop.flux.margin_q8 * 10 / 256);
    }
}
