/* SPDX-License-Identifier: MIT */
#include "firmware/control/weakening.h"

#include "firmware/control/stage_weaken.h"
#include "firmware/settings/config.h"
#include "lib/limit.h"
#include "lib/polar.h"
#include "lib/q15.h"

/* ==== the tables ==== */

#define PART_SHIFT 12
#define LAST       (WEAKENING_NODES - 1)

/* The last row not above the flux: a binary search over rows 0...24, which steps of 16 and 8 cover. */
static int32_t row_below(const struct weakening *w, int32_t flux_q15)
{
    int32_t n = 0;
    for (int32_t step = WEAKENING_BELOW; step > 0; step /= 2) {
        n += n + step < WEAKENING_ROWS && w->flux_q15[n + step] <= flux_q15 ? step : 0;
    }
    return n;
}

struct weakening_row weakening_row(const struct weakening *w, int32_t flux_q15)
{
    const int32_t n = row_below(w, flux_q15);
    const struct weakening_node *const lower = w->node[n];
    const int32_t above_q15 = flux_q15 - w->flux_q15[n];
    if (n == WEAKENING_ROWS - 1 || above_q15 <= 0) {
        return (struct weakening_row){lower, lower, 0};
    }
    const uint32_t gap_q15 = (uint32_t)(w->flux_q15[n + 1] - w->flux_q15[n]);
    const uint32_t part_q10 = ((uint32_t)above_q15 << 10) / gap_q15;
    return (struct weakening_row){lower, w->node[n + 1], (int32_t)(part_q10 << (PART_SHIFT - 10))};
}

struct weakening_node weakening_least_current(const struct torque_map *m, int32_t torque_q15)
{
    return (struct weakening_node){.torque_q15 = (int16_t)torque_q15,
                                   .i_d_q15 = (int16_t)torque_map_at(m, m->i_d_q15, torque_q15),
                                   .i_q_q15 = (int16_t)torque_map_at(m, m->i_q_q15, torque_q15)};
}

static int32_t between(int32_t lower, int32_t upper, int32_t part_q12)
{
    return lower + (((upper - lower) * part_q12) >> PART_SHIFT);
}

static int32_t torque_at(const struct weakening_row *r, int32_t n)
{
    return between(r->lower[n].torque_q15, r->upper[n].torque_q15, r->part_q12);
}

static struct weakening_node node_between(const struct weakening_node *a, const struct weakening_node *b,
                                          int32_t part_q12)
{
    return (struct weakening_node){.torque_q15 = (int16_t)between(a->torque_q15, b->torque_q15, part_q12),
                                   .i_d_q15 = (int16_t)between(a->i_d_q15, b->i_d_q15, part_q12),
                                   .i_q_q15 = (int16_t)between(a->i_q_q15, b->i_q_q15, part_q12)};
}

static struct weakening_node node_at(const struct weakening_row *r, int32_t n)
{
    return node_between(&r->lower[n], &r->upper[n], r->part_q12);
}

static uint32_t square(const struct weakening_node *p)
{
    return (uint32_t)(p->i_d_q15 * p->i_d_q15) + (uint32_t)(p->i_q_q15 * p->i_q_q15);
}

/* The squared current is convex along a chord: a share of squares never gives too large a share of the chord. */
static int32_t torque_within(const struct weakening_node *a, const struct weakening_node *b, uint32_t most)
{
    const uint32_t from = square(a);
    const uint32_t to = square(b);
    const uint32_t gap = ((to - from) >> PART_SHIFT) + 1u;
    return between(a->torque_q15, b->torque_q15, q15_min((int32_t)((most - from) / gap), 1 << PART_SHIFT));
}

int32_t weakening_torque(const struct weakening_row *r, int32_t i_limit_q15)
{
    const uint32_t most = (uint32_t)i_limit_q15 * (uint32_t)i_limit_q15;
    const struct weakening_node last = node_at(r, LAST);
    if (square(&last) <= most) {
        return last.torque_q15;
    }
    struct weakening_node below = node_at(r, 0);
    if (square(&below) >= most) {
        return 0;
    }
    struct weakening_node above = last;
    int32_t n = 0;
    for (int32_t step = LAST / 2; step > 0; step /= 2) {
        const struct weakening_node middle = node_at(r, n + step);
        if (square(&middle) <= most) {
            n += step;
            below = middle;
        } else {
            above = middle;
        }
    }
    return torque_within(&below, &above, most);
}

struct weakening_node weakening_currents(const struct weakening_row *r, int32_t torque_q15)
{
    int32_t n = 0;
    for (int32_t step = LAST / 2; step > 0; step /= 2) {
        n += torque_at(r, n + step) <= torque_q15 ? step : 0;
    }
    const struct weakening_node a = node_at(r, n);
    const struct weakening_node b = node_at(r, n + 1);
    const int32_t gap = q15_max(b.torque_q15 - a.torque_q15, 1);
    const int32_t part_q12 = (q15_clamp(torque_q15 - a.torque_q15, 0, gap) << PART_SHIFT) / gap;
    return node_between(&a, &b, part_q12);
}

/* ==== the flux that the voltage leaves ==== */

#define RETREAT_SHARE_Q11 \
    717 /* 0.35: with a current loop of three samples and a delay of one and a half, 49 degrees of margin */
#define RADIANS_Q4 \
    (CONFIG_SPEED_BASE_HZ * 2 * 355 / 113 * 16 / CONFIG_SLOW_HZ) /* of the base speed in a slow period: 7.9 at 20 kHz */
#define RADIANS_SHIFT 4
/* an eighth of the error a millisecond: 125 rad/s, a fiftieth of the current loop's crossover */
#define TRIM_SHIFT    3
#define TRIM_DRIVING  2 /* a quarter of the circle more */
#define TRIM_BRAKING  3 /* an eighth: with too much flux a braking current increases by itself */
#define TRIM_MIN      1 /* half of it less */
#define TRIM_FRACTION 6
#define SHORT_SHIFT   4  /* 16 ms: averages the harmonics, because the trim responds to it */
#define SHORT_FREE    7  /* a 128th of i_max is ignored: flux costs more there */
#define GAIN_MIN_Q8   32 /* of the current loops' gains */
#define V_D_MAX_Q10   (LOOP_V_D_MAX_STEPS * 1000 / CONFIG_RADIUS_STEPS) /* of the circle, less a 40th */
#define PAST_SHIFT    4 /* of the circle: half of what v_d leaves when first */
#define DROP_SHIFT    3 /* 8 ms: torque and flux limit are coupled; a faster response could oscillate */
#define DROP_MAX_Q15  (1 << 15)

/* Seven eighths of the circle less the reserve, per bus voltage; rounded down. */
#define FAR_Q15 \
    ((int32_t)(CONFIG_RADIUS_STEPS * 32768LL * 7 * ((1 << FLUX_RESERVE_SHIFT) - 1) / (8LL << FLUX_RESERVE_SHIFT) / \
               CONFIG_BUS_STEPS))

static int32_t circle_q15(int32_t vbus_q15, int32_t radius_steps)
{
    return (int32_t)((uint32_t)(vbus_q15 * (radius_steps >> 1)) / (CONFIG_BUS_STEPS >> 1));
}

static int32_t resistive_q15(const struct tuning *t, int32_t i_q15)
{
    return q15_sat16((t->r_q12 * q15_sat16(i_q15)) >> 12);
}

/* Beyond the modulator's circle additional voltage increases harmonics: half the reserve. */
static int32_t reserve_q15(int32_t circle, int32_t radius_steps)
{
    return circle >> (radius_steps > CONFIG_RADIUS_STEPS ? FLUX_RESERVE_SHIFT + 2 : FLUX_RESERVE_SHIFT);
}

static int32_t target_q15(int32_t vbus_q15, int32_t radius_steps)
{
    const int32_t circle = circle_q15(vbus_q15, radius_steps);
    return circle - reserve_q15(circle, radius_steps);
}

int32_t flux_limit_at(int32_t vbus_q15, int32_t w_q15)
{
    return (int32_t)(((uint32_t)target_q15(vbus_q15, CONFIG_RADIUS_STEPS) << 15) / (uint32_t)w_q15);
}

/* v over L for a slow period, from the reactance at the base speed. */
int32_t flux_limit_slew_q15(const struct tuning *t, int32_t vbus_q15)
{
    return reserve_q15(circle_q15(vbus_q15, t->radius_steps), t->radius_steps) * (RADIANS_Q4 << (11 - RADIANS_SHIFT)) /
           (q15_max(t->x_q_q11, t->x_q_apparent_q11) + 1);
}

/* v^2 - (w psi)^2, from the references and the torque of the last step. */
static void follow_drop(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                        int32_t power_q15)
{
    const int32_t d_q15 = resistive_q15(t, c->i_d_ref_q15);
    const int32_t q_q15 = resistive_q15(t, c->i_q_ref_q15);
    const int32_t resistive = ((d_q15 * d_q15) >> 15) + ((q_q15 * q_q15) >> 15);
    const int32_t driving = q15_clamp((t->r_q12 * q15_sat16(power_q15)) >> 11, -DROP_MAX_Q15, DROP_MAX_Q15);
    s->drop_q15 += (q15_clamp(resistive + driving, -DROP_MAX_Q15, DROP_MAX_Q15) - s->drop_q15) >> DROP_SHIFT;
}

static int32_t length_q15(const volatile struct current_loop *c)
{
    const int32_t d_q15 = c->v_d_q15;
    const int32_t q_q15 = c->v_q_q15;
    return polar_root((uint32_t)(d_q15 * d_q15) + (uint32_t)(q_q15 * q_q15));
}

/*
 * The voltage lacking in the second axis (stage_weaken.h): its current error, as voltage for the flux. The voltages' length
 * does not show what the circle clips off harmonic peaks. Driving, with q first, it does: a d current of most of i_max lags
 * behind the pulses of a rectified bus whenever it falls, and flux for that would be lost for good. Beyond the circle the
 * hexagon's own harmonics are clipped off the first axis, too: d's mean then stays short of its reference at any length.
 */
static int32_t lacking_q15(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                           int32_t w_q15, int32_t max_q15)
{
    const int32_t short_d_q15 = q15_sat16(c->i_d_ref_q15 - c->i_d_q15);
    const int32_t short_q_q15 =
        q15_sat16(c->i_q_ref_q15 < 0 ? c->i_q_q15 - c->i_q_ref_q15 : c->i_q_ref_q15 - c->i_q_q15);
    const int32_t wx_d_q11 = q15_sat16(tuning_reactance_q11(w_q15, t->x_d_q11));
    const int32_t wx_q_q11 = q15_sat16(tuning_reactance_q11(w_q15, t->x_q_q11));
    const bool q_first = c->weaken.q_first != 0;
    const bool brakes = q_first && c->v_d_q15 > 0;
    const bool d_is_cut = !brakes && c->weaken.radius_steps > CONFIG_RADIUS_STEPS;
    s->short_d_q15 += ((d_is_cut ? -short_d_q15 : 0) - s->short_d_q15) >> SHORT_SHIFT;
    const int32_t second = brakes ? short_d_q15 * wx_d_q11 : q_first ? 0 : short_q_q15 * wx_q_q11;
    const int32_t first = q15_max(s->short_d_q15 - (t->i_max_q15 >> SHORT_FREE), 0) * wx_d_q11;
    return q15_clamp((second >> 11) + (first >> 11), -max_q15, 8 * max_q15);
}

/*
 * How far the voltages are below their limit: in total, and while braking also v_d, if the handlers limit it to part of the
 * circle.
 */
static int32_t left_q15(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                        int32_t target, int32_t power_q15)
{
    const int32_t left = target - length_q15(c);
    if (c->weaken.on) {
        return left - lacking_q15(s, c, t, q15_abs(current_loop_w_q15(c)), target >> FLUX_RESERVE_SHIFT);
    }
    const int32_t d_max_q15 = (target * V_D_MAX_Q10) >> 10;
    return power_q15 < 0 ? q15_min(left, d_max_q15 - q15_abs(c->v_d_q15)) : left;
}

static void follow_trim(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                        int32_t target, int32_t power_q15)
{
    const int32_t left = left_q15(s, c, t, target, power_q15);
    s->exceeded = left < 0 && power_q15 < 0;
    if (!s->decides && left > 0) {
        s->trim_q21 -= s->trim_q21 / FLUX_TRIM_FADE;
        return;
    }
    const int32_t max_q15 = target >> (power_q15 < 0 ? TRIM_BRAKING : TRIM_DRIVING);
    s->trim_q21 = q15_clamp(s->trim_q21 + (left * (1 << (TRIM_FRACTION - TRIM_SHIFT))),
                            -((target >> TRIM_MIN) << TRIM_FRACTION), max_q15 << TRIM_FRACTION);
}

/*
 * Whether the limit is far: neither the largest flux ever asked for at this speed nor the present
 * voltages exceed seven eighths of the limit. vbus_q15 is current; the current loop's voltages and references are one step old.
 */
static bool is_far(const struct flux_limit *s, const volatile struct current_loop *c, int32_t w_q15, int32_t vbus_q15,
                   int32_t max_q15)
{
    const int32_t much_q15 = (vbus_q15 * FAR_Q15) >> 15;
    const int32_t d_q15 = q15_abs(c->v_d_q15);
    const int32_t q_q15 = q15_abs(c->v_q_q15);
    return q15_abs(s->trim_q21) < FLUX_TRIM_FADE && max_q15 <= 2 * Q15_ONE &&
           (uint32_t)w_q15 * (uint32_t)max_q15 <= (uint32_t)much_q15 << 15 &&
           q15_max(d_q15, q_q15) + q15_min(d_q15, q_q15) / 2 <= much_q15; /* an eighth too long at most */
}

bool flux_limit_follow(struct flux_limit *s, const volatile struct current_loop *c, const struct tuning *t,
                       int32_t vbus_q15, int32_t power_q15, int32_t max_q15)
{
    const int32_t w_q15 = q15_abs(current_loop_w_q15(c));
    if (is_far(s, c, w_q15, vbus_q15, max_q15)) {
        flux_limit_reset(s);
        return false;
    }
    const int32_t target = target_q15(vbus_q15, c->weaken.radius_steps);
    follow_drop(s, c, t, power_q15);
    follow_trim(s, c, t, target, power_q15);
    const int32_t usable_q15 = target + (s->trim_q21 >> TRIM_FRACTION);
    const int32_t square_q15 = q15_max(((usable_q15 * usable_q15) >> 15) - s->drop_q15, 0);
    const int32_t wanted_q15 = (int32_t)(((int64_t)w_q15 * max_q15) >> 15);
    if (wanted_q15 <= Q15_ONE && (wanted_q15 * wanted_q15) >> 15 <= square_q15) {
        s->flux_q15 = FLUX_UNLIMITED;
    } else {
        s->flux_q15 = (int32_t)(((uint32_t)polar_root((uint32_t)square_q15 << 15) << 15) / (uint32_t)q15_max(w_q15, 1));
    }
    return true;
}

/* How far i_d must fall per step of voltage, times the share the loop tolerates. 0 below half of the circle. */
static int32_t retreat_gain_q15(const struct tuning *t, int32_t w_q15, int32_t vbus_q15)
{
    const int32_t size_q15 = q15_abs(w_q15);
    if ((size_q15 * t->emf_q12) >> 12 < circle_q15(vbus_q15, t->radius_steps) >> 1) {
        return 0;
    }
    const uint32_t step_q30 = ((uint32_t)vbus_q15 << 15) / CONFIG_BUS_STEPS;
    const uint32_t reactance_q11 = (uint32_t)tuning_reactance_q11(size_q15, t->x_d_q11);
    const uint32_t gain_q15 = step_q30 * RETREAT_SHARE_Q11 / (reactance_q11 + 1u);
    const int32_t limited_q15 = gain_q15 > WEAKEN_GAIN_MAX_Q15 ? WEAKEN_GAIN_MAX_Q15 : (int32_t)gain_q15;
    return w_q15 < 0 ? -limited_q15 : limited_q15;
}

/*
 * Near the voltage limit, a current loop that responds to the sixth harmonics, of the EMF or the hexagon, asks for unavailable
 * voltage, and clipping costs fundamental. So its crossover is lowered there to half the electrical speed, a twelfth of theirs,
 * and no lower: a slower loop settles slowly in a turning frame. It starts falling 1/8 below the modulator's circle.
 */
static int32_t gain_share_q8(const volatile struct current_loop *c, const struct tuning *t, int32_t w_q15,
                             int32_t vbus_q15)
{
    const int32_t circle = circle_q15(vbus_q15, CONFIG_RADIUS_STEPS);
    const int32_t span_q15 = (circle >> 3) + 1;
    const int32_t near_q15 = q15_clamp(length_q15(c) - circle + span_q15, 0, span_q15);
    const int32_t by_speed_q8 = tuning_reactance_q11(q15_abs(w_q15), t->x_d_q11) * 128 / (t->kp_d_q12 + 1);
    const int32_t min_q8 = q15_clamp(by_speed_q8, GAIN_MIN_Q8, 256);
    const int32_t missing_q8 = 256 - (256 - min_q8) * near_q15 / span_q15 - c->weaken.gain_share_q8;
    return c->weaken.gain_share_q8 + (missing_q8 + (missing_q8 > 0 ? 3 : 0)) / 4;
}

/* The controller's first response to a step of the q reference, plus half of what remains of the last. */
static int32_t kick_steps(volatile struct current_loop *c)
{
    const int32_t step_q15 = q15_abs(c->i_q_ref_q15 - c->weaken.i_q_ref_before_q15);
    const int32_t answer_steps = (int32_t)(((int64_t)step_q15 * c->kp_q_q9) >> 9);
    c->weaken.i_q_ref_before_q15 = c->i_q_ref_q15;
    c->weaken.kick_steps = q15_max(c->weaken.kick_steps / 2, answer_steps);
    return c->weaken.kick_steps;
}

/* The voltage v_d leaves to v_q with both currents at their references. */
static int32_t steady_room_steps(const volatile struct current_loop *c, const struct tuning *t, int32_t w_q15,
                                 int32_t vbus_q15)
{
    const uint32_t x_q11 = (uint32_t)q15_max(t->x_q_q11, t->x_q_apparent_q11);
    const int32_t wx_q11 = (int32_t)(((uint32_t)q15_abs(w_q15) * x_q11) >> 15);
    const int32_t v_d_q15 = q15_sat16((q15_sat16(q15_abs(c->i_q_ref_q15)) * q15_sat16(wx_q11)) >> 11);
    const int32_t room_q15 = circle_rest_q15(v_d_q15, circle_q15(vbus_q15, c->weaken.radius_steps));
    return (int32_t)((uint32_t)room_q15 * CONFIG_BUS_STEPS / (uint32_t)q15_max(vbus_q15, 1));
}

/*
 * q is first while v_d takes more than half of the circle and a lack of v_q would take still more of it: while braking; and
 * while driving with more than cancels the magnets, v_q against the speed, where a salient rotor has its most torque per
 * voltage. With less v_d there is little torque: most voltage may be EMF, and d keeps what it needs to weaken it. Braking,
 * whose v_d is > 0 in either direction, lasts until the current is gone, later than the demand for it.
 */
static bool q_comes_first(const volatile struct current_loop *c, int32_t w_q15, bool braking, int32_t circle)
{
    const int32_t against_q15 = w_q15 < 0 ? c->v_q_q15 : -c->v_q_q15;
    const int32_t half_q15 = circle >> 1;
    return braking ? c->v_d_q15 > half_q15 : c->v_d_q15 < -half_q15 && against_q15 > circle >> PAST_SHIFT;
}

void flux_limit_guide(volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15)
{
    const int32_t w_q15 = current_loop_w_q15(c);
    const int32_t radius_steps = c->weaken.radius_steps;
    const bool braking = ((c->i_q_ref_q15 ^ w_q15) | (c->i_q_q15 ^ w_q15)) < 0;
    const bool q_first = q_comes_first(c, w_q15, braking, circle_q15(vbus_q15, radius_steps));
    c->weaken.gain_share_q8 = gain_share_q8(c, t, w_q15, vbus_q15);
    c->weaken.q_first = q_first ? -1 : 0;
    c->weaken.first_max_steps = q_first   ? WEAKEN_Q_MAX_STEPS(radius_steps)
                                : braking ? LOOP_V_D_MAX_STEPS
                                          : WEAKEN_D_MAX_STEPS(radius_steps);
    c->weaken.room_q_steps = q_first ? 0 : steady_room_steps(c, t, w_q15, vbus_q15) + kick_steps(c);
    c->weaken.gain_q15 = retreat_gain_q15(t, w_q15, vbus_q15);
    c->weaken.max_q15 = q15_clamp(t->i_max_q15 + c->i_d_ref_q15, 0, t->i_max_q15);
}
