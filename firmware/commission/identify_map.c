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
#include <stddef.h>

#include "firmware/commission/identify_parts.h"
#include "lib/polar.h"

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

/* Of rated current, in twelfths: halves and thirds. */
#define TWELFTHS 12
static const int8_t along_twelfths[] = {-12, -6, 6, 12};
static const int8_t across_twelfths[] = {4, 8, 12};

/* ---- the points of a leg, each a phase ---- */

static bool is_small(const struct identify *d, const struct identify_map_point *p)
{
    return q15_abs(p->i_d_q15) + q15_abs(p->i_q_q15) < d->i_rated_q15 / 5 * 2;
}

static struct identify_map_point *begin_point(struct identify *d, int32_t i_d_q15, int32_t i_q_q15, int32_t rpm)
{
    struct identify_map *const m = &d->work.map;
    struct identify_map_point *const p = &m->at[m->points++];
    *p = (struct identify_map_point){.i_d_q15 = i_d_q15, .i_q_q15 = i_q_q15, .rpm = q15_max(rpm, 1)};
    /* beside a small current that ripples a small wave, lest phases change their signs */
    const bool halved = d->ripple_q10 != 0 && is_small(d, p);
    p->v_steps = halved ? q15_max(d->wave_steps / 2, 1) : d->wave_steps;
    return p;
}

/* True if it is this leg's first millisecond, and there are points to measure. */
static bool begins(struct identify *d, const struct measure_io *io)
{
    if (d->ms != 1u || !d->open) {
        return false;
    }
    d->work.map.sign = 1;
    if (d->ripple_q10 != 0) {
        io->loop->ripple_q10 = 0; /* nothing else changes it now */
        io->loop->dead_shift = UNCOMPENSATED_SHIFT;
    }
    return true;
}

static void next_point(struct identify *d)
{
    d->work.map.way_ms = d->work.map.ways = 0;
    identify_enter(d, d->phase + 1u);
}

static void end_point(struct identify *d, bool done)
{
    if (done || d->phase_ms > PATIENCE_MS) {
        next_point(d);
    }
}

/* ---- waves ---- */

static bool arrived(const struct identify *d, const volatile struct current_loop *c)
{
    const int32_t away_q15 = q15_max(q15_abs(c->i_q_ref_q15 - c->i_q_q15), q15_abs(c->i_d_ref_q15 - c->i_d_q15));
    return away_q15 * ARRIVED_PART <= d->i_rated_q15;
}

/* True if the current lies near a phase, on either side. */
static bool near_phase(const struct identify *d, const struct identify_map_point *p,
                       const volatile struct current_loop *c)
{
    const uint32_t smooth_q32 = is_small(d, p) && !d->reluctant ? NEARER_Q32 : NEAR_Q32;
    const uint32_t near_q32 = d->ripple_q10 != 0 ? NEAREST_Q32 : smooth_q32;
    const uint32_t i_q32 = atan2_q32(c->i_q_ref_q15, c->i_d_ref_q15) + current_loop_angle_q32(c);
    return (i_q32 + near_q32) % SIXTH_Q32 <= 2u * near_q32;
}

/* Waves along and across take turns. */
static void play(struct identify *d, struct identify_map_point *p, uint32_t half, bool both,
                 const struct measure_io *io)
{
    volatile struct current_loop *const c = io->loop;
    if (p->bursts[half] >= BURSTS_HALF || !near_phase(d, p, c)) {
        return;
    }
    const uint32_t axis = both ? p->bursts[half] % 2u : 0u;
    const uint32_t field_q32 = current_loop_angle_q32(c);
    d->burst.turn_q32 = c->pll.speed_q32;
    const int32_t room_steps = burst_room_steps(c);
    if (p->bursts[0] + p->bursts[1] == 0u) {
        p->v_steps = q15_min(p->v_steps, room_steps);
    }
    if (p->v_steps > room_steps) {
        return; /* it turns faster than at the first */
    }
    d->burst.v_steps = p->v_steps;
    identify_play(d, io, field_q32, field_q32 + axis * QUARTER_Q32);
    burst_add(&p->sums[axis][half], &d->burst, c->vbus_q15);
    p->bursts[half]++;
}

static bool has_all(const struct identify_map_point *p)
{
    return p->bursts[0] >= BURSTS_HALF && p->bursts[1] >= BURSTS_HALF;
}

/* ---- along ---- */

static void begin_along(struct identify *d)
{
    const uint32_t points = d->reluctant ? 2u : 4u; /* with the magnets, reluctance turns it round */
    d->wave_steps = d->burst.v_steps;
    for (uint32_t k = 0; k < points; k++) {
        (void)begin_point(d, d->i_rated_q15 * along_twelfths[k] / TWELFTHS, 0,
                          d->rpm_most / (d->reluctant ? RELUCTANT_PART : ALONG_PART));
    }
}

bool identify_measure_along(struct identify *d, const struct measure_io *io)
{
    struct identify_map *const m = &d->work.map;
    if (begins(d, io)) {
        begin_along(d);
    }
    if (d->phase == m->points) {
        return true; /* the next leg begins with this speed */
    }
    struct identify_map_point *const p = &m->at[d->phase];
    const uint32_t settle_ms = SETTLE_MS + (d->reluctant ? SUM_MS : 0u);
    const int32_t from_q15 = d->phase == 0u ? 0 : m->at[d->phase - 1u].i_d_q15;
    /* the constant speeds have ended that way round; time counts while it is there */
    d->phase_ms -= measure_spin(io, -p->rpm, identify_i_most_q15(d)) ? 0u : 1u;
    io->loop->i_d_ref_q15 = from_q15 + measure_ramp(p->i_d_q15 - from_q15, d->phase_ms, RISE_MS);
    if (d->phase_ms > settle_ms) {
        play(d, p, p->bursts[0] > p->bursts[1] ? 1u : 0u, false, io);
    } else if (d->phase_ms > SETTLE_MS) {
        measure_run_add(&p->run[0][0], io, io->loop->v_d_q15);
    }
    end_point(d, has_all(p));
    return false;
}

/* ---- across ---- */

static void sum_up(struct identify_map_point *p, int32_t sign, const struct measure_io *io)
{
    const uint32_t half = sign > 0 ? 0u : 1u;
    measure_run_add(&p->run[half][0], io, io->loop->v_q_q15);
    measure_run_add(&p->run[half][1], io, -sign * io->loop->v_d_q15);
}

/* A swing that never comes past a phase becomes wider. */
static void map_turn_round(const struct identify *d, struct identify_map *m, struct identify_map_point *p,
                           int32_t x_q15)
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

/* One millisecond of swings; true when all points have theirs. */
static bool swing(struct identify *d, const struct measure_io *io)
{
    struct identify_map *const m = &d->work.map;
    if (d->phase == m->points) {
        return true;
    }
    struct identify_map_point *const p = &m->at[d->phase];
    const int32_t most_q15 = p->rpm * 32768, x_q15 = io->speed->estimate.speed_rpm_q15;
    measure_push(io, m->sign * p->i_q_q15);
    io->loop->i_d_ref_q15 = measure_ramp(p->i_d_q15, d->phase_ms, RISE_MS);
    if (m->way_ms > ARRIVE_MS && d->phase_ms > (uint32_t)RISE_MS && arrived(d, io->loop)) {
        if (p->fluxes && (m->ways & SUM_WAYS) != 0u) {
            sum_up(p, m->sign, io);
        } else if (d->ripple_q10 == 0 || q15_abs(x_q15) < most_q15 / 2) {
            play(d, p, m->sign > 0 ? 0u : 1u, true, io);
        }
    }
    map_turn_round(d, m, p, m->sign * x_q15);
    end_point(d, (m->ways >= LEAST_WAYS || !p->fluxes) && has_all(p));
    return false;
}

bool identify_measure_across(struct identify *d, const struct measure_io *io)
{
    const size_t points = sizeof across_twelfths;
    if (begins(d, io)) {
        for (size_t k = 0; k < points; k++) {
            begin_point(d, 0, d->i_rated_q15 * across_twelfths[k] / TWELFTHS,
                        d->swing_rpm * across_twelfths[k] / TWELFTHS)
                ->fluxes = d->reluctant && k + 1u == points;
        }
    }
    return swing(d, io);
}

/* The last leg ends at rest. */
bool identify_measure_torque(struct identify *d, const struct measure_io *io)
{
    if (begins(d, io)) {
        begin_point(d, d->torque_d_q15, d->torque_q_q15, d->rpm_most)->fluxes = true;
    }
    if (!swing(d, io)) {
        return false;
    }
    if (d->phase_ms == 1u) {
        speed_loop_reset(io->speed, 0);
    }
    return identify_stop_rotor(d, io, PATIENCE_MS);
}
