/* SPDX-License-Identifier: MIT */
/*
 * Inductances and fluxes over current, in the rotor's frame: waves on top of a current (identify_burst.h), while the rotor
 * turns slowly. Three legs, each a step:
 *
 *     along     i_d against the magnets and with them, at a constant speed
 *     across    i_q to either side by turns, which swings the rotor between two speeds
 *     torque    the same, with i_d as it makes most torque, where reluctance has a part in that
 *
 * Swings by turns have waves, or their voltages are summed up over the speed:
 *
 *     v_q = R i_q + w psi_d        v_d = R i_d - w psi_q
 *
 * so the slopes are the fluxes of this very current, and neither resistance nor dead time, which do not change with the
 * speed, are in them.
 *
 * Dead time costs what the signs of the phases' currents say. So a wave waits until the current lies near to a phase, where
 * the two others carry enough of it not to change their signs. Where the current ripples, compensation would follow waves, and
 * there is none: its knee is as wide as the ripple.
 */
#include "firmware/commission/identify_parts.h"
#include "lib/polar.h"
#include "lib/q15.h"

#define BURSTS_HALF         16u /* of waves: half of them along, half across */
#define QUARTER_Q32         0x40000000u
#define SIXTH_Q32           0x2AAAAAABu
#define NEAR_Q32            0x0CCCCCCDu /* 18 degrees */
#define NEARER_Q32          0x093E93E9u /* 13, beside a small current */
#define NEAREST_Q32         0x071C71C7u /* 10, of a current that ripples, and half of the speed */
#define ARRIVED_PART        16          /* of the rated current */
#define ARRIVE_MS           10u
#define UNCOMPENSATED_SHIFT 31u
#define RISE_MS             20
#define SETTLE_MS           40u
#define SUM_MS              128u /* of a reluctant machine's resistance */
#define ALONG_PART          3    /* of the largest speed */
#define RELUCTANT_PART      6    /* there a frame that is off by a degree would show in the resistance */
#define LEAST_WAYS          4u   /* from end to end: a pair of ways with waves, a pair with sums */
#define SUM_WAYS            2u
#define ENOUGH_WAYS         6u
#define PATIENCE_MS         2500u
#define REST_MS             50u

/* Of rated current, in twelfths: halves and thirds. */
#define TWELFTHS 12
static const int8_t along_twelfths[] = {-12, -6, 6, 12};
static const int8_t across_twelfths[] = {4, 8, 12};

/* ---- the points of a leg ---- */

static void begin_along(const struct identify *d, struct identify_map *m)
{
    m->points = d->reluctant ? 2u : 4u; /* with the magnets, reluctance turns it round */
    for (uint32_t k = 0; k < m->points; k++) {
        m->at[k].i_d_q15 = d->i_rated_q15 * along_twelfths[k] / TWELFTHS;
        m->at[k].rpm = q15_max(d->rpm_most / (d->reluctant ? RELUCTANT_PART : ALONG_PART), 1);
    }
}

static void begin_across(const struct identify *d, struct identify_map *m)
{
    m->points = 3u;
    for (uint32_t k = 0; k < m->points; k++) {
        m->at[k].fluxes = d->reluctant && k + 1u == m->points;
        m->at[k].i_q_q15 = d->i_rated_q15 * across_twelfths[k] / TWELFTHS;
        m->at[k].rpm = q15_max(d->swing_rpm * across_twelfths[k] / TWELFTHS, 1);
    }
}

static void begin_torque(const struct identify *d, struct identify_map *m)
{
    m->points = 1u;
    m->at[0].i_d_q15 = d->torque_d_q15;
    m->at[0].i_q_q15 = d->torque_q_q15;
    m->at[0].rpm = d->rpm_most;
    m->at[0].fluxes = true;
}

static bool is_small(const struct identify *d, const struct identify_map_point *p)
{
    return q15_abs(p->i_d_q15) + q15_abs(p->i_q_q15) < d->i_rated_q15 / 5 * 2;
}

/* Beside a small current that ripples a small wave, lest phases change their signs. */
static void choose_waves(const struct identify *d, struct identify_map *m)
{
    for (uint32_t k = 0; k < m->points; k++) {
        const bool halved = d->ripple_q10 != 0 && is_small(d, &m->at[k]);
        m->at[k].v_steps = halved ? q15_max(d->wave_steps / 2, 1) : d->wave_steps;
    }
}

/* Skips what is refused already. */
static bool is_wanted(const struct identify *d)
{
    const enum identify_quantity first = d->step == IDENTIFY_STEP_ALONG    ? IDENTIFY_LD_D2_BACK
                                         : d->step == IDENTIFY_STEP_ACROSS ? IDENTIFY_LD_Q1
                                                                           : IDENTIFY_TORQUE_ID;
    return d->results[first].state == IDENTIFY_UNKNOWN;
}

static void begin(struct identify *d, const struct identify_io *io)
{
    struct identify_map *const m = &d->map;
    *m = (struct identify_map){.sign = 1};
    speed_loop_reset(io->speed, 0);
    if (!is_wanted(d)) {
        return;
    }
    if (d->ripple_q10 != 0) {
        io->loop->ripple_q10 = 0; /* nothing else changes it now */
        io->loop->dead_shift = UNCOMPENSATED_SHIFT;
    }
    if (d->step == IDENTIFY_STEP_ALONG) {
        d->wave_steps = d->burst.v_steps;
        begin_along(d, m);
    } else if (d->step == IDENTIFY_STEP_ACROSS) {
        begin_across(d, m);
    } else {
        begin_torque(d, m);
    }
    choose_waves(d, m);
}

static void next(struct identify_map *m)
{
    m->point++;
    m->phase_ms = m->way_ms = m->ways = 0;
}

/* ---- waves ---- */

static bool arrived(const struct identify *d, const volatile struct current_loop *c)
{
    const int32_t away_q15 = q15_max(q15_abs(c->i_q_ref_q15 - c->i_q_q15), q15_abs(c->i_d_ref_q15 - c->i_d_q15));
    return away_q15 * ARRIVED_PART <= d->i_rated_q15;
}

static uint32_t nearness_q32(const struct identify *d, const struct identify_map_point *p)
{
    if (d->ripple_q10 != 0) {
        return NEAREST_Q32;
    }
    return is_small(d, p) && !d->reluctant ? NEARER_Q32 : NEAR_Q32;
}

/* True if the current lies near a phase, on either side. */
static bool near_phase(const struct identify *d, const struct identify_map_point *p,
                       const volatile struct current_loop *c)
{
    const uint32_t near_q32 = nearness_q32(d, p);
    const uint32_t i_q32 = atan2_q32(c->i_q_ref_q15, c->i_d_ref_q15) + current_loop_angle_q32(c);
    return (i_q32 + near_q32) % SIXTH_Q32 <= 2u * near_q32;
}

/* Waves along and across take turns. */
static void play(struct identify *d, struct identify_map_point *p, uint32_t half, bool both,
                 const struct identify_io *io)
{
    struct burst *const b = &d->burst;
    volatile struct current_loop *const c = io->loop;
    if (p->bursts[half] >= BURSTS_HALF || !near_phase(d, p, c)) {
        return;
    }
    const uint32_t axis = both ? p->bursts[half] % 2u : 0u;
    b->field_q32 = current_loop_angle_q32(c);
    b->angle_q32 = b->field_q32 + axis * QUARTER_Q32;
    b->turn_q32 = c->pll.speed_q32;
    b->v_steps = p->v_steps;
    burst_play(b, c, &io->fabric->adc);
    burst_add(&p->sums[axis][half], b, c->vbus_q15);
    p->bursts[half]++;
}

static bool has_all(const struct identify_map_point *p)
{
    return p->bursts[0] >= BURSTS_HALF && p->bursts[1] >= BURSTS_HALF;
}

/* ---- along ---- */

static void lead_d(const struct identify_map *m, volatile struct current_loop *c)
{
    const int32_t from_q15 = m->point == 0u ? 0 : m->at[m->point - 1u].i_d_q15;
    const int32_t way_q15 = m->at[m->point].i_d_q15 - from_q15;
    c->i_d_ref_q15 = from_q15 + way_q15 * q15_min((int32_t)m->phase_ms, RISE_MS) / RISE_MS;
}

static void along(struct identify *d, struct identify_map *m, const struct identify_io *io)
{
    struct identify_map_point *const p = &m->at[m->point];
    const uint32_t settle_ms = SETTLE_MS + (d->reluctant ? SUM_MS : 0u);
    const int32_t rpm = -p->rpm; /* the constant speeds have ended that way round */
    identify_control_speed(io, rpm, identify_i_most_q15(d));
    m->phase_ms += io->speed->ref_rpm_q16 == rpm * 65536 ? 1u : 0u;
    lead_d(m, io->loop);
    if (m->phase_ms > settle_ms) {
        play(d, p, p->bursts[0] > p->bursts[1] ? 1u : 0u, false, io);
    } else if (m->phase_ms > SETTLE_MS) {
        identify_run_add_v(&p->run[0][0], io, io->loop->v_d_q15);
    }
    if (has_all(p)) {
        next(m);
    }
}

/* ---- across ---- */

static void sum_up(struct identify_map_point *p, int32_t sign, const struct identify_io *io)
{
    const uint32_t half = sign > 0 ? 0u : 1u;
    identify_run_add(&p->run[half][0], io);
    identify_run_add_v(&p->run[half][1], io, -sign * io->loop->v_d_q15);
}

/* A swing that never comes past a phase becomes wider. */
static void turn_round(const struct identify *d, struct identify_map *m, struct identify_map_point *p, int32_t x_q15)
{
    m->way_ms++;
    if (x_q15 < p->rpm * 32768) {
        return;
    }
    m->sign = -m->sign;
    m->way_ms = 0;
    m->ways++;
    if (m->ways > ENOUGH_WAYS && !has_all(p)) {
        p->rpm = q15_min(p->rpm + p->rpm / 4 + 1, q15_max(p->rpm, d->rpm_most));
    }
}

static void across(struct identify *d, struct identify_map *m, const struct identify_io *io)
{
    struct identify_map_point *const p = &m->at[m->point];
    const int32_t most_q15 = p->rpm * 32768, x_q15 = io->speed->estimate.speed_rpm_q15;
    m->phase_ms++;
    identify_push(io, m->sign * p->i_q_q15);
    io->loop->i_d_ref_q15 = p->i_d_q15 * q15_min((int32_t)m->phase_ms, RISE_MS) / RISE_MS;
    if (m->way_ms > ARRIVE_MS && m->phase_ms > (uint32_t)RISE_MS && arrived(d, io->loop)) {
        if (p->fluxes && (m->ways & SUM_WAYS) != 0u) {
            sum_up(p, m->sign, io);
        } else if (d->ripple_q10 == 0 || q15_abs(x_q15) < most_q15 / 2) {
            play(d, p, m->sign > 0 ? 0u : 1u, true, io);
        }
    }
    turn_round(d, m, p, m->sign * x_q15);
    if ((m->ways >= LEAST_WAYS || !p->fluxes) && has_all(p)) {
        next(m);
    }
}

/* ---- a leg ---- */

/* To rest. */
static bool finish(const struct identify *d, struct identify_map *m, const struct identify_io *io)
{
    if (m->phase_ms == 0u) {
        speed_loop_reset(io->speed, 0);
    }
    m->phase_ms++;
    identify_control_speed(io, 0, identify_i_most_q15(d));
    return (io->speed->ref_rpm_q16 == 0 && m->phase_ms > REST_MS) || m->phase_ms > PATIENCE_MS;
}

bool identify_measure_map(struct identify *d, const struct identify_io *io)
{
    struct identify_map *const m = &d->map;
    if (d->ms == 1u) {
        begin(d, io);
    }
    if (m->point == m->points) {
        return d->step != IDENTIFY_STEP_TORQUE || finish(d, m, io); /* a leg begins with the speed of the one before */
    }
    if (d->step == IDENTIFY_STEP_ALONG) {
        along(d, m, io);
    } else {
        across(d, m, io);
    }
    if (m->phase_ms > PATIENCE_MS) {
        next(m);
    }
    return false;
}
