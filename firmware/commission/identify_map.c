/* SPDX-License-Identifier: MIT */
/*
 * Inductances and fluxes over current, in the rotor's frame: waves on top of a current (pulses.h), while the rotor turns
 * slowly. Three parts, each a step:
 *
 *     along     i_d against the magnets and with them, at a constant speed
 *     across    i_q of alternating sign, which moves the rotor between two speeds
 *     torque    the same, with i_d of maximum torque per current, if reluctance contributes
 *
 * Either waves are played, or voltages are summed over the speed:
 *
 *     v_q = R i_q + w psi_d        v_d = R i_d - w psi_q
 *
 * so the slopes are the fluxes at this current, independent of resistance and dead time, which do not change with speed.
 *
 * The dead-time error depends on the signs of the phase currents. So a wave is played when the current is close to a phase's
 * axis, where the two others are large enough not to change sign. With current ripple there is no compensation meanwhile:
 * within its knee, which is as wide as the ripple, it would respond to the wave.
 */
#include <stddef.h>

#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"
#include "firmware/settings/mtpa.h"
#include "lib/deadtime.h"
#include "lib/polar.h"

/* ==== evaluation of the map ==== */

/*
 * Evaluates the map's waves and voltages. Two coupled windings respond to a voltage along d by
 *
 *     di_d = u T L_qq / D,   di_q = -u T L_dq / D,   D = L_dd L_qq - L_dq^2
 *
 * so a wave sees L_dd less L_dq^2 / L_qq, and the ratio of the responses across and along is -L_dq / L_qq; along q the same
 * with d and q exchanged. The sign of L_dq is that of i_q; L_dd and L_qq are the same for both.
 */

#define MILLION       1000000
#define COUPLED_MAX   500000 /* millionths: plausibility limit */
#define MIN_BURSTS    8u
#define CROSS_BOUND   5   /* thousandths: error of cross saturation by angle and slots */
#define SALIENT_PART  4   /* of the rated current: with less of it in d there is no point of its own */
#define LATE_MS       5   /* time for reversal of a current */
#define SWING_MS      80  /* from one speed to the other: time for the waves */
#define LONG_SWING_MS 150 /* of a reluctance machine, until it has passed a phase's axis */
#define LATE_PART     3
#define MIN_PHASE     3  /* in it there is a third of the current that lies along another, or a little more */
#define HIDDEN_TENTHS 7  /* of that */
#define MIN_PERCENT   28 /* the same, where currents need not lie so near */
#define KNEE_PERMILLE 80 /* found on the bench: up to a tenth */
#define FLUX_PERMILLE 10 /* slots, and iron that has losses */
#define CROSS_PERCENT 10 /* of what i_q across takes from d's voltage */
#define DEAD_NS       50 /* by which dead time costs less at half of the current */

/* ---- one point ---- */

/* Results with one sign of i_q. */
struct seen {
    int64_t nh[2];     /* along d, along q; 0: none */
    int64_t cross_ppm; /* L_dq by L_qq */
};

/* Across by along, millionths. */
static int64_t across_ppm(const struct burst_sums *s)
{
    return s->ud > 0 ? identify_scaled(s->uq, MILLION, s->ud) : 0;
}

static struct seen see(struct identify *d, const struct identify_map_point *p, uint32_t half)
{
    const int64_t of_d = across_ppm(&p->sums[0][half]), of_q = across_ppm(&p->sums[1][half]);
    const int64_t coupled = -of_d * of_q / MILLION;
    const int64_t alone = MILLION - (coupled < 0 ? 0 : coupled < COUPLED_MAX ? coupled : COUPLED_MAX);
    d->burst.v_steps = p->v_steps;
    struct seen s = {.cross_ppm = half == 0u ? -of_d : of_d};
    for (int32_t axis = 0; axis < 2; axis++) {
        s.nh[axis] = identify_scaled(identify_inductance_nh(d, &p->sums[axis][half]), MILLION, alone);
    }
    return s;
}

static bool was_seen(const struct identify_map_point *p)
{
    return p->bursts[0] >= MIN_BURSTS && p->bursts[1] >= MIN_BURSTS;
}

/* Amplitude of a wave, in Q15 of current. */
static int64_t wave_q15(const struct identify *d, const struct burst_sums *s)
{
    return s->count == 0 ? 0 : identify_size(identify_scaled(s->ud, d->burst.hold, s->count));
}

/* Dead time is compensated, and a wave across the current reaches phases within the compensation's knee. */
static bool is_in_knee(const struct identify *d, const struct identify_map_point *p, uint32_t axis)
{
    const int64_t min_q15 = p->i_q_q15 * MIN_PERCENT / 100;
    return axis == 0u && p->i_q_q15 > 0 && d->ripple_q10 == 0 &&
           min_q15 < wave_q15(d, &p->sums[0][0]) + DEADTIME_KNEE_Q15;
}

/*
 * The inductance along an axis of points `from` to the last. Its error by the current's gain follows from the slope to the
 * previous point, or for the first one to the next, `steps` of them from zero current.
 */
static void know_along_axis(struct identify *d, enum identify_quantity first, uint32_t axis, const int32_t steps[])
{
    const struct identify_map *const m = &d->work.map;
    int64_t halves[IDENTIFY_MAP_POINTS][2];
    for (uint32_t k = 0; k < m->points; k++) {
        for (uint32_t half = 0; half < 2u; half++) {
            halves[k][half] = see(d, &m->at[k], half).nh[axis];
        }
    }
    for (uint32_t k = 0; k < m->points; k++) {
        const enum identify_quantity what = (enum identify_quantity)((uint32_t)first + k);
        d->burst.v_steps = m->at[k].v_steps;
        const uint32_t other = k == 0u ? (m->points > 1u ? 1u : 0u) : k - 1u;
        const int64_t slope_nh = identify_size(halves[k][0] + halves[k][1] - halves[other][0] - halves[other][1]) / 2;
        if (!was_seen(&m->at[k])) {
            identify_refuse(d, what, what, IDENTIFY_TOO_LIGHT);
            continue;
        }
        const int64_t shift_nh = scale(slope_nh * steps[k], IDENTIFY_CURRENT_GAIN_PERMILLE, 1000);
        const int64_t knee_nh = is_in_knee(d, &m->at[k], axis) ? identify_permille(halves[k][0], KNEE_PERMILLE) : 0;
        identify_know_inductance(d, what, halves[k], identify_root(shift_nh * shift_nh + knee_nh * knee_nh));
    }
}

/* From slopes of v_q and v_d with both signs of i_q, 0.1 uWb; false: not measured. */
static bool map_know_flux(struct identify *d, const struct identify_map_point *p, uint32_t which,
                          struct identify_spread *flux)
{
    int64_t of[2];
    for (uint32_t half = 0; half < 2u; half++) {
        const struct measure_run *const run = &p->run[half][which];
        of[half] = identify_flux_of_runs(d, &run, 1);
    }
    *flux = (struct identify_spread){(of[0] + of[1]) / 2, identify_size(of[0] - of[1]) / 2};
    return of[0] > 0 && of[1] > 0 && !identify_scatters(flux);
}

/* ---- along ---- */

/* nV in d without w Lq i_q, which is in `cross`. */
static int64_t along_nv(const struct identify *d, const struct measure_run *r, int64_t *cross_nv)
{
    const int64_t flux_fwb = identify_ua(d, r->i, r->count) * d->results[IDENTIFY_LQ].value;
    const int64_t mrad_s = identify_mrad_s(r->x * 64, r->count) * d->params.pole_pairs;
    *cross_nv = identify_scaled(flux_fwb, mrad_s, 1000000000);
    return identify_nv(d, r->v, r->count) + *cross_nv;
}

/* Of a reluctant machine: the rotor's frame turns slowly, and two currents along the magnets differ. */
static void know_resistance(struct identify *d)
{
    const struct identify_map_point *const full = &d->work.map.at[0], *const half = &d->work.map.at[1];
    if (full->run[0][0].count == 0 || half->run[0][0].count == 0) {
        return;
    }
    int64_t full_cross_nv, half_cross_nv;
    const int64_t ua = identify_ua(d, half->i_d_q15 - full->i_d_q15, 1);
    const int64_t nv = along_nv(d, &half->run[0][0], &half_cross_nv) - along_nv(d, &full->run[0][0], &full_cross_nv);
    if (nv <= 0 || ua <= 0) {
        return;
    }
    const int64_t uohm = scale(nv, 1000, ua);
    const int64_t dead_uohm = scale(scale(d->bus_nv, DEAD_NS * (int64_t)CONFIG_PWM_HZ, 1000000000), 1000, ua);
    const int64_t gains = identify_permille(uohm, IDENTIFY_CURRENT_GAIN_PERMILLE + IDENTIFY_BUS_GAIN_PERMILLE);
    const int64_t cross_uohm = scale(identify_size(half_cross_nv - full_cross_nv) * CROSS_PERCENT / 100, 1000, ua);
    const int64_t others = identify_root(dead_uohm * dead_uohm + cross_uohm * cross_uohm);
    if (others * 2 > uohm) {
        return;
    }
    identify_set(d, IDENTIFY_RESISTANCE, uohm, identify_interval(0, gains, others));
    d->params.resistance_mohm = (int32_t)(uohm < 1000 ? 1 : scale(uohm, 1, 1000));
}

/* Speed change, rpm, by rated current in LATE_MS, from the ramps' acceleration. */
static int64_t late_rpm(const struct identify *d)
{
    const int64_t at_rated =
        scale(identify_size(d->ramp_mrad_s2), d->i_rated_q15, d->ramp_i_q15 < 1 ? 1 : d->ramp_i_q15);
    return scale(at_rated * LATE_MS, 60LL * 1000, TWO_PI_E9);
}

enum identify_reason identify_evaluate_along(struct identify *d)
{
    static const int32_t halves[] = {2, 1, 1, 2};
    know_along_axis(d, IDENTIFY_LD_D2_BACK, 0, halves);
    if (d->reluctant) {
        identify_refuse(d, IDENTIFY_LD_D1, IDENTIFY_LD_D2, IDENTIFY_TURNED);
        know_resistance(d);
    }
    /* long enough; refused if the speed changes too much during the reversal of the current */
    const int64_t late = late_rpm(d);
    d->swing_rpm = identify_within(late * (d->reluctant ? LONG_SWING_MS : SWING_MS) / (2 * LATE_MS), d->rpm_max);
    if (d->ramp_mrad_s2 == 0 || late * LATE_PART > d->rpm_max) { /* too few samples: inertia is smaller still */
        identify_refuse_rest(d, IDENTIFY_TOO_LIGHT);
    }
    return IDENTIFY_NO_REASON;
}

/* ---- across ---- */

/* The current split of maximum torque, by the q flux at rated current. */
static bool choose_torque(struct identify *d)
{
    struct identify_spread across;
    if (!d->reluctant || !map_know_flux(d, &d->work.map.at[2], 1, &across)) {
        return false;
    }
    struct params p = d->params;
    const int64_t rated_ua = identify_ua(d, d->i_rated_q15, 1);
    p.flux_uwb = (int32_t)scale(d->flux_e1_uwb, 1, 10);
    p.ld_uh = d->results[IDENTIFY_LD].value / 1000 + 1;
    p.lq_uh = (int32_t)scale(across.mean, 100000, rated_ua) + 1; /* 0.1 uWb by uA is 1e5 uH */
    const struct mtpa_machine machine = mtpa_machine(&p);
    const struct mtpa_point point = mtpa_point(&machine, (int64_t)d->i_rated_q15 << 5);
    const int32_t i_d_q15 = (int32_t)(point.i_d_q20 >> 5);
    d->torque_d_q15 = machine.reversed ? i_d_q15 : -i_d_q15;
    d->torque_q_q15 = (int32_t)(point.i_q_q20 >> 5);
    return machine.saliency != 0 && i_d_q15 * SALIENT_PART > d->i_rated_q15;
}

/* mV at the end of the speeds at which waves are played. */
static int64_t voltage_mv(const struct identify *d, const struct identify_map_point *p)
{
    const int64_t i_ua = identify_ua(d, p->i_q_q15, 1);
    const int64_t mrad_s = identify_mrad_s(p->rpm * 32768LL / 2, 1) * d->params.pole_pairs;
    return scale(i_ua, d->params.resistance_mohm, 1000000) + scale(mrad_s, d->flux_e1_uwb, 10000000);
}

/*
 * Across the current a wave drives the two phases with the smallest current, a third of it. If they change their signs by the
 * wave or the ripple, dead time is part of the response.
 */
static bool is_hidden(const struct identify *d, const struct identify_map_point *p)
{
    const struct burst_sums *const s = &p->sums[0][0];
    if (d->ripple_q10 == 0 || s->count == 0) {
        return false;
    }
    const int64_t v_q15 = scale(voltage_mv(d, p), 32768, d->params.v_range_mv);
    const int64_t ripple_q15 = (v_q15 * d->ripple_q10) >> 10;
    return p->i_q_q15 * HIDDEN_TENTHS < (wave_q15(d, s) + ripple_q15) * 10 * MIN_PHASE;
}

static void refuse_hidden(struct identify *d)
{
    for (uint32_t k = 0; k < d->work.map.points; k++) {
        const enum identify_quantity what = (enum identify_quantity)((uint32_t)IDENTIFY_LD_Q1 + k);
        if (d->results[what].reason != IDENTIFY_TOO_LIGHT && is_hidden(d, &d->work.map.at[k])) {
            identify_refuse(d, what, what, IDENTIFY_RIPPLED);
        }
    }
}

enum identify_reason identify_evaluate_across(struct identify *d)
{
    static const int32_t thirds[] = {1, 2, 3};
    know_along_axis(d, IDENTIFY_LD_Q1, 0, thirds);
    know_along_axis(d, IDENTIFY_LQ_Q1, 1, thirds);
    refuse_hidden(d);
    if (!choose_torque(d)) {
        identify_refuse_rest(d, IDENTIFY_NOT_SALIENT);
    }
    return IDENTIFY_NO_REASON;
}

/* ---- maximum torque per current ---- */

/* The interval of a flux at one current; its gain error is included in the derived quantity. */
static void know_torque_flux(struct identify *d, enum identify_quantity what, const struct identify_spread *flux)
{
    identify_set(d, what, flux->mean,
                 identify_interval(flux->deviation, identify_permille(flux->mean, IDENTIFY_CURRENT_GAIN_PERMILLE),
                                   identify_permille(flux->mean, IDENTIFY_BUS_GAIN_PERMILLE + FLUX_PERMILLE)));
}

enum identify_reason identify_evaluate_torque(struct identify *d)
{
    const struct identify_map_point *const p = &d->work.map.at[0];
    struct identify_spread along, across;
    if (!was_seen(p) || !map_know_flux(d, p, 0, &along) || !map_know_flux(d, p, 1, &across)) {
        identify_refuse_rest(d, IDENTIFY_TOO_LIGHT);
        return IDENTIFY_NO_REASON;
    }
    identify_set_exact(d, IDENTIFY_TORQUE_ID, (int32_t)identify_ua(d, p->i_d_q15, 1000));
    identify_set_exact(d, IDENTIFY_TORQUE_IQ, (int32_t)identify_ua(d, p->i_q_q15, 1000));
    know_torque_flux(d, IDENTIFY_TORQUE_FLUX, &along);
    know_torque_flux(d, IDENTIFY_TORQUE_ACROSS, &across);
    const int64_t forth_ppm = see(d, p, 0).cross_ppm, back_ppm = see(d, p, 1).cross_ppm;
    identify_set(d, IDENTIFY_CROSS, identify_scaled(forth_ppm + back_ppm, 1, 2000),
                 identify_interval(scale(identify_size(forth_ppm - back_ppm), 1, 2000), CROSS_BOUND,
                                   scale(identify_size(forth_ppm), IDENTIFY_CURRENT_GAIN_PERMILLE, MILLION)));
    return IDENTIFY_NO_REASON;
}

#define BURSTS_HALF    16u /* of waves: half of them along, half across */
#define QUARTER_Q32    0x40000000u
#define SIXTH_Q32      0x2AAAAAABu
#define NEAR_Q32       0x0CCCCCCDu /* 18 degrees */
#define NEARER_Q32     0x093E93E9u /* 13 degrees, at a small current */
#define NEAREST_Q32    0x071C71C7u /* 10 degrees with ripple, and half of the speed */
#define ARRIVED_PART   16          /* of the rated current */
#define ARRIVE_MS      10u
#define RISE_MS        20
#define SETTLE_MS      40u
#define SUM_MS         128u /* for the resistance of a reluctance machine */
#define ALONG_PART     3    /* of the maximum speed */
#define RELUCTANT_PART 6    /* in that case an angle error of a degree would affect the resistance */
#define MIN_RUNS       4u   /* runs from speed to speed: a pair with waves, a pair with sums */
#define SUM_RUNS       2u
#define MAX_RUNS       6u
#define TIMEOUT_MS     2500u

/* Of rated current, in twelfths: halves and thirds. */
#define TWELFTHS 12
static const int8_t along_twelfths[] = {-12, -6, 6, 12};
static const int8_t across_twelfths[] = {4, 8, 12};

/* ---- the points of a step, each a phase ---- */

static bool is_small(const struct identify *d, const struct identify_map_point *p)
{
    return q15_abs(p->i_d_q15) + q15_abs(p->i_q_q15) < d->i_rated_q15 / 5 * 2;
}

static struct identify_map_point *begin_point(struct identify *d, int32_t i_d_q15, int32_t i_q_q15, int32_t rpm)
{
    struct identify_map *const m = &d->work.map;
    struct identify_map_point *const p = &m->at[m->points++];
    *p = (struct identify_map_point){.i_d_q15 = i_d_q15, .i_q_q15 = i_q_q15, .rpm = q15_max(rpm, 1)};
    /* at a small current with ripple a small wave, so that phases do not change their signs */
    const bool halved = d->ripple_q10 != 0 && is_small(d, p);
    p->v_steps = halved ? q15_max(d->wave_steps / 2, 1) : d->wave_steps;
    return p;
}

/* True if it is this step's first millisecond, and there are points to measure. */
static bool begins(struct identify *d, const struct measure_io *io)
{
    if (d->ms != 1u || !d->open) {
        return false;
    }
    d->work.map.sign = 1;
    if (d->ripple_q10 != 0) {
        current_loop_forget_ripple(io->loop); /* nothing else changes the compensation now */
        current_loop_compensate(io->loop, false);
    }
    return true;
}

static void next_point(struct identify *d)
{
    d->work.map.run_ms = d->work.map.runs = 0;
    identify_enter(d, d->phase + 1u);
}

static void end_point(struct identify *d, bool done)
{
    if (done || d->phase_ms > TIMEOUT_MS) {
        next_point(d);
    }
}

/* ---- waves ---- */

static bool arrived(const struct identify *d, const volatile struct current_loop *c)
{
    const int32_t away_q15 = q15_max(q15_abs(c->i_q_ref_q15 - c->i_q_q15), q15_abs(c->i_d_ref_q15 - c->i_d_q15));
    return away_q15 * ARRIVED_PART <= d->i_rated_q15;
}

/* True if the current is close to a phase's axis, of either sign. */
static bool near_phase(const struct identify *d, const struct identify_map_point *p,
                       const volatile struct current_loop *c)
{
    const uint32_t smooth_q32 = is_small(d, p) && !d->reluctant ? NEARER_Q32 : NEAR_Q32;
    const uint32_t near_q32 = d->ripple_q10 != 0 ? NEAREST_Q32 : smooth_q32;
    const uint32_t i_q32 = atan2_q32(c->i_q_ref_q15, c->i_d_ref_q15) + current_loop_angle_q32(c);
    return (i_q32 + near_q32) % SIXTH_Q32 <= 2u * near_q32;
}

/* Alternates waves along and across. */
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
        return; /* the rotor turns faster than at the first wave */
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
    /* with current in the magnets' direction reluctance would turn the rotor */
    const uint32_t points = d->reluctant ? 2u : 4u;
    d->wave_steps = d->burst.v_steps;
    for (uint32_t k = 0; k < points; k++) {
        (void)begin_point(d, d->i_rated_q15 * along_twelfths[k] / TWELFTHS, 0,
                          d->rpm_max / (d->reluctant ? RELUCTANT_PART : ALONG_PART));
    }
}

bool identify_measure_along(struct identify *d, const struct measure_io *io)
{
    struct identify_map *const m = &d->work.map;
    if (begins(d, io)) {
        begin_along(d);
    }
    if (d->phase == m->points) {
        return true; /* the next step begins at this speed */
    }
    struct identify_map_point *const p = &m->at[d->phase];
    const uint32_t settle_ms = SETTLE_MS + (d->reluctant ? SUM_MS : 0u);
    const int32_t from_q15 = d->phase == 0u ? 0 : m->at[d->phase - 1u].i_d_q15;
    /* the constant speeds have ended in that direction; time counts while the speed is reached */
    d->phase_ms -= measure_spin(io, -p->rpm, identify_i_max_q15(d)) ? 0u : 1u;
    current_loop_set_i_d(io->loop, from_q15 + measure_ramp(p->i_d_q15 - from_q15, d->phase_ms, RISE_MS));
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

/* A run that passes no phase's axis becomes longer. */
static void map_turn_round(const struct identify *d, struct identify_map *m, struct identify_map_point *p,
                           int32_t x_q15)
{
    m->run_ms++;
    if (x_q15 < p->rpm * 32768) {
        return;
    }
    m->sign = -m->sign;
    m->run_ms = 0;
    m->runs++;
    if (m->runs > MAX_RUNS && !has_all(p)) {
        p->rpm = q15_min(p->rpm + p->rpm / 4 + 1, q15_max(p->rpm, d->rpm_max));
    }
}

/* One millisecond of runs between two speeds; true when all points are complete. */
static bool swing(struct identify *d, const struct measure_io *io)
{
    struct identify_map *const m = &d->work.map;
    if (d->phase == m->points) {
        return true;
    }
    struct identify_map_point *const p = &m->at[d->phase];
    const int32_t max_q15 = p->rpm * 32768, x_q15 = io->speed->estimate.speed_rpm_q15;
    measure_push(io, m->sign * p->i_q_q15);
    current_loop_set_i_d(io->loop, measure_ramp(p->i_d_q15, d->phase_ms, RISE_MS));
    if (m->run_ms > ARRIVE_MS && d->phase_ms > (uint32_t)RISE_MS && arrived(d, io->loop)) {
        if (p->fluxes && (m->runs & SUM_RUNS) != 0u) {
            sum_up(p, m->sign, io);
        } else if (d->ripple_q10 == 0 || q15_abs(x_q15) < max_q15 / 2) {
            play(d, p, m->sign > 0 ? 0u : 1u, true, io);
        }
    }
    map_turn_round(d, m, p, m->sign * x_q15);
    end_point(d, (m->runs >= MIN_RUNS || !p->fluxes) && has_all(p));
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

/* The last step ends at rest. */
bool identify_measure_torque(struct identify *d, const struct measure_io *io)
{
    if (begins(d, io)) {
        begin_point(d, d->torque_d_q15, d->torque_q_q15, d->rpm_max)->fluxes = true;
    }
    if (!swing(d, io)) {
        return false;
    }
    if (d->phase_ms == 1u) {
        speed_loop_reset(io->speed, 0);
    }
    return identify_stop_rotor(d, io, TIMEOUT_MS);
}
