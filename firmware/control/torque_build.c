/* SPDX-License-Identifier: MIT */
#include "firmware/control/torque_build.h"

#include "firmware/control/current_loop.h"
#include "firmware/control/stage_weaken.h"
#include "firmware/control/weakening.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/scale.h"
#include "lib/limit.h"
#include "lib/polar.h"
#include "lib/q15.h"
#include "lib/trig.h"

/* Whether rated torque at speed_max needs currents beyond the ordinary handlers at the present bus voltage. */
static bool needs_weakening(const struct torque_control *s, const struct params *p, const struct tuning *t,
                            int32_t vbus_q15)
{
    const int32_t rated_q15 = q15_min(tuning_q15_from_milli(p->i_rated_ma, p->i_range_ma), t->i_max_q15);
    const int32_t w_q15 = (int32_t)((int64_t)p->speed_max_rpm * t->overspeed_w_q15 / p->overspeed_rpm);
    const int32_t flux_q15 = flux_limit_at(vbus_q15, q15_max(w_q15, 1));
    const struct weakening_row row = weakening_row(&s->weakening, flux_q15);
    return flux_q15 < s->weakening.top_q15 &&
           weakening_torque(&row, t->i_max_q15) < torque_map_reach(&s->map, s->map.current_q15, rated_q15);
}

/* The table for the ordinary handlers is finished: whether another one is needed. */
static bool begin_again(struct torque_builder *b, struct torque_control *s, const struct params *p, struct tuning *t)
{
    const bool needed = source_has((uint32_t)p->angle_source, SOURCE_WEAKENS) &&
                        (p->overmodulation != 0 || needs_weakening(s, p, t, b->vbus_q15));
    t->weakens = FEATURE_IN(WEAKENING) && needed;
    b->lacks_weakening = needed && !t->weakens;
    if (t->weakens) {
        t->radius_steps = CONFIG_RADIUS_STEPS + (CONFIG_SIX_STEPS - CONFIG_RADIUS_STEPS) * p->overmodulation / 100;
        weakening_build_begin(&b->weakening, &s->weakening, &s->map, p, t, WEAKEN_D_MAX_STEPS(CONFIG_RADIUS_STEPS));
    }
    return t->weakens;
}

void torque_build_begin(struct torque_builder *b, struct torque_control *s, const struct params *p,
                        const struct tuning *t, int32_t vbus_q15)
{
    b->part = TORQUE_BUILDS_MAP;
    b->vbus_q15 = vbus_q15;
    b->lacks_weakening = false;
    torque_map_build_begin(&b->map, &s->map, p, t);
}

bool torque_build_step(struct torque_builder *b, struct torque_control *s, const struct params *p, struct tuning *t)
{
    if (b->part == TORQUE_BUILDS_MAP) {
        if (!torque_map_build_step(&b->map, &s->map, p, t)) {
            b->part = TORQUE_BUILDS_ORDINARY;
            weakening_build_begin(&b->weakening, &s->weakening, &s->map, p, t, LOOP_V_D_MAX_STEPS);
        }
        return true;
    }
    if (weakening_build_step(&b->weakening, &s->weakening, &s->map)) {
        return true;
    }
    const bool ordinary = b->part == TORQUE_BUILDS_ORDINARY;
    b->part = TORQUE_BUILDS_WEAKENING;
    flux_limit_reset(&s->flux);
    return ordinary && begin_again(b, s, p, t);
}

/* ==== field weakening ==== */

/*
 * The table of weakening.h, at `on`. Only the ends of rows are searched; a node is a flux vector, from which the rest is
 * calculated.
 */

#define V_D_REST        64 /* of v_d, kept back */
#define LAST            (WEAKENING_NODES - 1)
#define ROWS_ABOVE      (WEAKENING_ROWS - 1 - WEAKENING_BELOW)
#define FLUX_LIMIT      (1 << 21) /* 64 v_range at the base speed */
#define CURRENT_MAX_Q15 (1 << 20)
#define ANGLE_STEP      (1u << 20) /* a third of 1/4096 turn: the step that distinguishes growing torque from falling */
#define HALF_TURN       (1u << 31)
#define QUARTER_TURN    (1u << 30)

struct point {
    int64_t i_d_q15, i_q_q15;
    int64_t product_q30; /* torque: flux times current */
};

static int32_t limited_flux(int64_t flux_q15)
{
    return scale_clamp(flux_q15, INT32_MIN, FLUX_LIMIT);
}

/* 2 pi f psi over v_range; nWb are 1e-9, mV 1e-3, 2 pi has 9 decimals. */
static int64_t volts_q15(const struct params *p, int64_t flux_nwb)
{
    return scale(flux_nwb * CONFIG_SPEED_BASE_HZ, TWO_PI_E9 / 1000 * 32768, p->v_range_mv * 1000000000000LL);
}

static int64_t reactance_q19(const struct params *p, int32_t inductance_uh)
{
    const int64_t x = scale(((int64_t)inductance_uh * p->i_range_ma) << 19, TWO_PI_E9 / 1000 * CONFIG_SPEED_BASE_HZ,
                            p->v_range_mv * 1000000000000LL);
    return x < 1 ? 1 : x;
}

/*
 * The share of the whole flux's voltage that v_d allows, less the resistance's part. If that is all of it, any angle is
 * allowed.
 */
static void take_v_d(struct weakening_machine *m, int32_t v_d_max_steps)
{
    const int32_t whole_steps = CONFIG_RADIUS_STEPS - (CONFIG_RADIUS_STEPS >> FLUX_RESERVE_SHIFT);
    const int32_t d_steps = q15_min(v_d_max_steps - v_d_max_steps / V_D_REST, whole_steps);
    m->share_max_q15 = (d_steps << 15) / whole_steps;
    m->angle_max = d_steps == whole_steps ? HALF_TURN : atan2_q32(d_steps, circle_rest_q15(d_steps, whole_steps));
}

static struct weakening_machine machine_of(const struct params *p, const struct tuning *t, int32_t v_d_max_steps)
{
    struct weakening_machine m = {
        .magnet_q15 = limited_flux(volts_q15(p, 1000LL * p->flux_uwb)),
        .x_d_q19 = reactance_q19(p, mtpa_ld_uh(p)),
        .x_q_q19 = reactance_q19(p, mtpa_lq_uh(p)),
        .torque_unit_q15 = volts_q15(p, mtpa_flux_nwb(p)),
        .i_max_q15 = t->i_max_q15,
    };
    m.torque_unit_q15 = m.torque_unit_q15 < 1 ? 1 : m.torque_unit_q15;
    take_v_d(&m, v_d_max_steps);
    return m;
}

/* Limits currents far beyond i_max, from very small inductances, so that their squares fit. */
static int64_t seen(int64_t i_q15)
{
    return scale_clamp(i_q15, -CURRENT_MAX_Q15, CURRENT_MAX_Q15);
}

/* A flux vector, `angle` from the magnets' axis towards q: its currents and torque. */
static struct point point_of(const struct weakening_machine *m, int32_t flux_q15, uint32_t angle)
{
    const cossin_t cs = cossin_q15(angle);
    const int64_t flux_d_q15 = ((int64_t)flux_q15 * cs.cos) >> 15;
    const int64_t flux_q_q15 = ((int64_t)flux_q15 * cs.sin) >> 15;
    struct point p = {.i_d_q15 = seen((flux_d_q15 - m->magnet_q15) * (1 << 19) / m->x_d_q19),
                      .i_q_q15 = seen(flux_q_q15 * (1 << 19) / m->x_q_q19)};
    p.product_q30 = flux_d_q15 * p.i_q_q15 - flux_q_q15 * p.i_d_q15;
    return p;
}

/* Whether this angle is still within the row: current and v_d are allowed, and torque still grows. */
static bool within_row(const struct weakening_machine *m, int32_t flux_q15, uint32_t angle)
{
    const struct point here = point_of(m, flux_q15, angle);
    const int64_t square = here.i_d_q15 * here.i_d_q15 + here.i_q_q15 * here.i_q_q15;
    return angle <= m->angle_max && square <= (int64_t)m->i_max_q15 * m->i_max_q15 &&
           point_of(m, flux_q15, angle + ANGLE_STEP).product_q30 > here.product_q30;
}

static uint32_t end_of(const struct weakening_machine *m, int32_t flux_q15, uint32_t from)
{
    uint32_t end = from;
    for (uint32_t step = QUARTER_TURN; step >= ANGLE_STEP; step /= 2u) {
        end += end + step < HALF_TURN && within_row(m, flux_q15, end + step) ? step : 0u;
    }
    return end;
}

/* The largest MTPA torque at which q has at most its share of this flux. */
static int32_t torque_of_share(const struct weakening_machine *m, const struct torque_map *map, int32_t flux_q15)
{
    const int64_t flux_q_q15 = ((int64_t)flux_q15 * m->share_max_q15) >> 15;
    const int64_t i_q_q15 = flux_q_q15 * (1 << 19) / m->x_q_q19;
    return q15_min(torque_map_reach(map, map->i_q_q15, limited_flux(i_q_q15)), map->torque_max_q15);
}

/* Where the contour crosses the MTPA curve, or i_q = 0. */
static uint32_t start_of(const struct weakening_machine *m, const struct torque_map *map, int32_t flux_q15)
{
    if (flux_q15 <= m->magnet_q15) {
        return 0;
    }
    const int32_t torque_q15 = q15_min(torque_map_reach(map, map->flux_q15, flux_q15), map->torque_max_q15);
    const struct weakening_node p = weakening_least_current(map, torque_q15);
    const int32_t d_q15 = m->magnet_q15 + (int32_t)((p.i_d_q15 * m->x_d_q19) >> 19);
    return atan2_q32((int32_t)((p.i_q_q15 * m->x_q_q19) >> 19), d_q15);
}

static struct weakening_node node_of(const struct weakening_machine *m, const struct point *p)
{
    const int64_t torque_q15 = p->product_q30 / m->torque_unit_q15;
    return (struct weakening_node){.torque_q15 = (int16_t)q15_clamp((int32_t)torque_q15, 0, INT16_MAX),
                                   .i_d_q15 = (int16_t)p->i_d_q15,
                                   .i_q_q15 = (int16_t)p->i_q_q15};
}

static void fill_alike(struct weakening_node *row, struct weakening_node all)
{
    for (uint32_t n = 0; n <= LAST; n++) {
        row[n] = all;
    }
}

/* A row without a part beyond the MTPA curve is its last point there: i_max or v_d ends it before the flux does. */
static void fill_row(struct weakening_node *row, const struct weakening_machine *m, const struct torque_map *map,
                     int32_t flux_q15)
{
    const uint32_t start = start_of(m, map, flux_q15);
    const uint32_t step = (end_of(m, flux_q15, start) - start) >> WEAKENING_NODES_BITS;
    if (flux_q15 > m->magnet_q15 && step == 0u) {
        fill_alike(row, weakening_least_current(map, torque_of_share(m, map, flux_q15)));
        return;
    }
    for (uint32_t n = 0; n <= LAST; n++) {
        const struct point p = point_of(m, flux_q15, start + n * step);
        row[n] = node_of(m, &p);
    }
}

/* Closer near the lowest flux, as squares; evenly spaced above the magnets'. */
static void lay_out(struct weakening *w, int32_t magnet_q15, int32_t low_q15)
{
    const int32_t below_q15 = magnet_q15 - low_q15;
    const int32_t above_q15 = q15_max(w->top_q15 - magnet_q15, 1);
    for (int32_t n = 0; n < WEAKENING_ROWS; n++) {
        const int32_t up = q15_max(n - WEAKENING_BELOW, 0);
        const int32_t root = q15_min(n, WEAKENING_BELOW);
        w->flux_q15[n] =
            low_q15 + below_q15 / (WEAKENING_BELOW * WEAKENING_BELOW) * (root * root) +
            below_q15 % (WEAKENING_BELOW * WEAKENING_BELOW) * (root * root) / (WEAKENING_BELOW * WEAKENING_BELOW) +
            (above_q15 * up + ROWS_ABOVE - 1) / ROWS_ABOVE;
    }
}

void weakening_build_begin(struct weakening_builder *b, struct weakening *w, const struct torque_map *map,
                           const struct params *p, const struct tuning *t, int32_t v_d_max_steps)
{
    const struct weakening_machine *const m = &b->machine;
    *b = (struct weakening_builder){.machine = machine_of(p, t, v_d_max_steps), .row = 1};
    const struct weakening_node most = weakening_least_current(map, map->torque_max_q15);
    const int64_t q_q15 = (most.i_q_q15 * m->x_q_q19) >> 19;
    const int32_t low_q15 = q15_max(m->magnet_q15 - limited_flux((m->i_max_q15 * m->x_d_q19) >> 19), 0);
    w->top_q15 = q15_max(limited_flux(torque_map_at(map, map->flux_q15, map->torque_max_q15)),
                         limited_flux(q_q15 * Q15_ONE / m->share_max_q15));
    lay_out(w, m->magnet_q15, low_q15);
    const struct point lowest = point_of(m, low_q15, 0);
    fill_alike(w->node[0],
               (struct weakening_node){.i_d_q15 = (int16_t)q15_max((int32_t)lowest.i_d_q15, -m->i_max_q15)});
    fill_alike(w->node[WEAKENING_ROWS - 1], most);
}

bool weakening_build_step(struct weakening_builder *b, struct weakening *w, const struct torque_map *map)
{
    fill_row(w->node[b->row], &b->machine, map, w->flux_q15[b->row]);
    b->row++;
    return b->row < WEAKENING_ROWS - 1;
}
