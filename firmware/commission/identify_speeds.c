/* SPDX-License-Identifier: MIT */
#include "drivers/fabric/encoder.h"
#include "firmware/commission/identify_parts.h"

/* ==== push and ramps ==== */

/*
 * The rotor is accelerated and braked between two speeds by one current of alternating sign. At the same speed friction and
 * load are equal in both, but the torques differ: J = (T1 - T2) / (a1 - a2), whatever the friction. The flux is that at this
 * current, from voltage over speed of the same ramps.
 */

#define RAMPS_TIMEOUT_MS 5000u
#define SLOW_TENTHS      2 /* of the maximum speed: range that is evaluated */
#define FAST_TENTHS      9
#define FEW_RAMPS        4 /* of a reluctant machine, whose ramps are long */
#define PAIRS_MAX        (IDENTIFY_RAMPS - 1)
#define LEAD_MS          300u
#define MIN_E1_UWB       100

#define FRAME_MRAD 60 /* 3.4 degrees */

/* Of the flux, at rated current: simulated machines lose 2 to 4 % at 1.5 times that. */
#define SATURATION_PERMILLE 50

static uint32_t ramps(const struct identify *d)
{
    return d->reluctant ? FEW_RAMPS : IDENTIFY_RAMPS;
}

/* ---- measuring ---- */

/* Speed in this ramp's direction: from -max to max. */
static void accelerate(struct identify *d, const struct measure_io *io)
{
    struct identify_ramps *const m = &d->work.ramps;
    const int32_t sign = d->phase % 2u == 0u ? 1 : -1;
    const int32_t max_q15 = d->rpm_max * 32768;
    const int32_t x_q15 = io->speed->estimate.speed_rpm_q15 * sign;
    const int32_t slow_q15 = max_q15 / 10 * SLOW_TENTHS, fast_q15 = max_q15 / 10 * FAST_TENTHS;
    measure_push(io, sign * d->ramp_i_q15);
    if (q15_abs(x_q15) > slow_q15 && q15_abs(x_q15) < fast_q15) {
        measure_run_add(x_q15 > 0 ? &m->gains[d->phase] : &m->slows[d->phase], io, io->loop->v_q_q15);
    }
    if (x_q15 >= max_q15) {
        identify_enter(d, d->phase + 1u);
        speed_loop_reset(io->speed, 0);
    }
}

/* If the offset can be measured only at a small current, the frame is corrected at constant speed first. True when done. */
static bool ramps_lead(struct identify *d, const struct measure_io *io)
{
    struct identify_ramps *const m = &d->work.ramps;
    if (!d->reluctant || m->led_ms >= LEAD_MS) {
        return true;
    }
    m->led_ms = measure_spin(io, -d->rpm_max, identify_i_max_q15(d)) ? m->led_ms + 1u : 0u;
    return false;
}

bool identify_measure_ramps(struct identify *d, const struct measure_io *io)
{
    identify_correct_offset(d, io);
    if (!ramps_lead(d, io)) {
        return d->phase_ms > RAMPS_TIMEOUT_MS;
    }
    if (d->phase == ramps(d)) {
        return identify_stop_rotor(d, io, RAMPS_TIMEOUT_MS);
    }
    accelerate(d, io);
    return d->phase_ms > RAMPS_TIMEOUT_MS;
}

/* ---- evaluation ---- */

/*
 * Of a ramp: braking and accelerating have the same current, so resistance and dead time are a common intercept. Speeds of both
 * signs triple the range.
 */
static int64_t flux_e1_uwb(const struct identify *d, const struct measure_run *slows, const struct measure_run *gains)
{
    const struct measure_run whole = {.count = slows->count + gains->count,
                                      .v = slows->v + gains->v,
                                      .x = slows->x + gains->x,
                                      .xx = slows->xx + gains->xx,
                                      .xv = slows->xv + gains->xv};
    const struct measure_run *const run = &whole;
    return identify_flux_of_runs(d, &run, 1);
}

/* With an angle error of the frame q current contributes to the d flux: nH by mrad by uA, 1e-18 Wb. */
static int64_t salient_e1_uwb(const struct identify *d)
{
    const int64_t difference_nh = identify_size(d->results[IDENTIFY_LQ].value - d->results[IDENTIFY_LD].value);
    return scale(difference_nh * FRAME_MRAD, identify_ua(d, d->ramp_i_q15, 1), 100000000000LL);
}

static enum identify_reason ramps_know_flux(struct identify *d)
{
    const struct identify_ramps *const m = &d->work.ramps;
    const uint32_t first = d->reluctant ? 0u : 1u; /* the first one starts at rest, unless it is run up */
    int64_t of[IDENTIFY_RAMPS];
    for (uint32_t k = first; k < ramps(d); k++) {
        of[k] = flux_e1_uwb(d, &m->slows[k], &m->gains[k]);
    }
    const struct identify_spread flux = identify_spread(of + first, (int32_t)(ramps(d) - first));
    if (flux.mean < MIN_E1_UWB || identify_scatters(&flux)) {
        return flux.mean < MIN_E1_UWB ? IDENTIFY_TOO_SLOW : IDENTIFY_SCATTER;
    }
    d->flux_e1_uwb = (int32_t)flux.mean;
    /* saturation increases with the square of the q current */
    const int64_t squared = scale((int64_t)d->ramp_i_q15 * d->ramp_i_q15, SATURATION_PERMILLE * 1000LL,
                                  (int64_t)d->i_rated_q15 * d->i_rated_q15);
    const int64_t gain_e1_uwb = identify_permille(flux.mean, IDENTIFY_BUS_GAIN_PERMILLE);
    const int64_t iron_e1_uwb = scale(flux.mean, squared, 1000000) + salient_e1_uwb(d);
    identify_set(d, IDENTIFY_FLUX, flux.mean, identify_interval(flux.deviation, gain_e1_uwb, iron_e1_uwb));
    return IDENTIFY_NO_REASON;
}

static void know_inertia(struct identify *d)
{
    const struct identify_ramps *const m = &d->work.ramps;
    int64_t of[PAIRS_MAX], bent_permille = 0;
    const int32_t pairs = (int32_t)ramps(d) - 1;
    for (int32_t k = 0; k < pairs; k++) {
        bent_permille += identify_bent_permille(&m->gains[k]) + identify_bent_permille(&m->slows[k + 1]);
        of[k] = identify_inertia_gmm2(d, d->flux_e1_uwb, &m->gains[k], &m->slows[k + 1]);
        if (of[k] == 0) {
            identify_refuse(d, IDENTIFY_INERTIA, IDENTIFY_INERTIA, IDENTIFY_TOO_LIGHT);
            return;
        }
    }
    const struct identify_spread inertia = identify_spread(of, pairs);
    if (inertia.mean < 1 || identify_scatters(&inertia)) {
        identify_refuse(d, IDENTIFY_INERTIA, IDENTIFY_INERTIA, IDENTIFY_SCATTER);
        return;
    }
    const int64_t gain = identify_permille(inertia.mean, IDENTIFY_CURRENT_GAIN_PERMILLE);
    const int64_t flux = scale(inertia.mean, d->results[IDENTIFY_FLUX].interval, d->flux_e1_uwb);
    const int64_t late = inertia.mean / m->slows[1].count; /* the current reverses within a millisecond */
    const int64_t bent = scale(inertia.mean, bent_permille, 2000LL * pairs);
    const int64_t others = identify_root(gain * gain + late * late + bent * bent);
    const int64_t interval = identify_interval(inertia.deviation, others, flux);
    if (2 * interval > inertia.mean) {
        const enum identify_reason against =
            bent > late && bent > inertia.deviation ? IDENTIFY_SWINGS : IDENTIFY_SCATTER;
        identify_refuse(d, IDENTIFY_INERTIA, IDENTIFY_INERTIA, against);
    } else {
        identify_set(d, IDENTIFY_INERTIA, inertia.mean, interval);
    }
    d->params.inertia_gmm2 = (int32_t)inertia.mean;
}

enum identify_reason identify_evaluate_ramps(struct identify *d)
{
    const enum identify_reason against = d->phase < ramps(d) ? IDENTIFY_LOADED : ramps_know_flux(d);
    d->ramp_mrad_s2 = identify_slope_mrad_s2(&d->work.ramps.gains[0]);
    if (against == IDENTIFY_NO_REASON && d->indexed) {
        know_inertia(d);
    }
    return against;
}

/* ==== pushes ==== */

/*
 * A q current increases until the rotor turns, and pushes it forward, back, forward again; each time until the EMF is 4 % of
 * the bus voltage. That is 7 % of the maximum speed at this bus voltage, independent of pole pairs. It gives a first flux and a
 * first inertia for regulating the speed.
 */

#define EMF_PART     25 /* of the bus */
#define EMF_SHIFT    3
#define ARRIVED_PART 16 /* of the rated current */
#define ARRIVE_MS    3u
#define GROW_MS      1000
#define PUSH_MAX_MS  3000u
#define MIN_TENTHS   2 /* of the rated current */
#define RAMP_TENTHS  4
#define STEEP_TENTHS 7 /* of a reluctant machine, whose ramps are long */
#define TIMES_HALVES 3 /* of the current at the first motion */
#define REST_MS      50u
#define INERTIA_MIN  1

enum push_phase {
    PUSH_GROW,
    PUSH_BACK,
    PUSH_FORWARD,
    PUSH_STOP,
    PUSH_REST,
};

/* While the current changes, the inductive voltage exceeds the EMF. */
static int32_t follow_emf(const struct identify *d, struct identify_push *m, const struct measure_io *io)
{
    const int32_t away_q15 = q15_abs(io->loop->i_q_ref_q15 - io->loop->i_q_q15);
    if (away_q15 * ARRIVED_PART <= d->i_rated_q15 && d->phase_ms > ARRIVE_MS) {
        m->emf_q18 += measure_emf_q15(io) - (m->emf_q18 >> EMF_SHIFT);
    }
    return m->emf_q18 >> EMF_SHIFT;
}

static void push_grow(struct identify *d, struct identify_push *m, const struct measure_io *io, bool arrived)
{
    const int32_t i_max_q15 = identify_i_max_q15(d);
    m->i_q15 = measure_ramp(i_max_q15, d->phase_ms, GROW_MS);
    measure_push(io, m->i_q15);
    if (arrived) {
        m->i_q15 = q15_clamp(m->i_q15 * TIMES_HALVES / 2, identify_tenths_q15(d, MIN_TENTHS), i_max_q15);
        identify_enter(d, PUSH_BACK);
    }
}

/* A run is from half of the maximum speed in one direction to all of it in the other. */
static void push(struct identify *d, struct identify_push *m, const struct measure_io *io, int32_t emf_q15,
                 int32_t max_q15)
{
    const int32_t sign = d->phase == PUSH_BACK ? -1 : 1;
    measure_push(io, sign * m->i_q15);
    if (emf_q15 * sign > -max_q15 / 2) {
        measure_run_add(&m->run[d->phase - PUSH_BACK], io, io->loop->v_q_q15);
    }
    if (emf_q15 * sign >= max_q15) {
        identify_enter(d, d->phase + 1u);
    }
}

bool identify_measure_push(struct identify *d, const struct measure_io *io)
{
    struct identify_push *const m = &d->work.push;
    const int32_t emf_q15 = follow_emf(d, m, io), max_q15 = io->loop->vbus_q15 / EMF_PART;
    identify_correct_offset(d, io);
    switch (d->phase) {
    case PUSH_GROW:
        push_grow(d, m, io, emf_q15 >= max_q15);
        break;
    case PUSH_BACK:
    case PUSH_FORWARD:
        push(d, m, io, emf_q15, max_q15);
        break;
    case PUSH_STOP:
        measure_push(io, -m->i_q15);
        if (io->speed->estimate.speed_rpm_q15 <= 0) {
            identify_enter(d, PUSH_REST);
        }
        break;
    case PUSH_REST:
    default:
        measure_push(io, 0);
        return d->phase_ms > REST_MS;
    }
    return d->phase_ms > PUSH_MAX_MS;
}

/* ---- evaluation ---- */

/* Speed limit of the push. */
static int32_t pushed_rpm(const struct identify *d)
{
    /* electrical: nV by 0.1 uWb, 1e-2 */
    const int64_t rad_s_e3 = identify_scaled(d->bus_nv, 10, (int64_t)EMF_PART * d->flux_e1_uwb);
    const int64_t rpm = identify_scaled(rad_s_e3, 60LL * 1000000, TWO_PI_E9 * d->params.pole_pairs);
    return identify_within(rpm, d->params.speed_max_rpm);
}

enum identify_reason identify_evaluate_push(struct identify *d)
{
    const struct identify_push *const m = &d->work.push;
    const struct measure_run *const runs[] = {&m->run[0], &m->run[1]};
    const int64_t flux = d->phase == PUSH_REST ? identify_flux_of_runs(d, runs, 2) : 0;
    const int64_t inertia = flux > 0 ? identify_inertia_gmm2(d, flux, runs[1], runs[0]) : 0;
    if (flux < 100 || inertia < INERTIA_MIN) {
        return IDENTIFY_NOT_PUSHED;
    }
    d->flux_e1_uwb = (int32_t)flux;
    d->ramp_i_q15 = m->i_q15;
    d->params.flux_uwb = identify_within(scale(flux, 1, 10), 10000000);
    d->params.inertia_gmm2 = identify_within(inertia, 2100000000);
    d->rpm_max = pushed_rpm(d);
    /* slope at this part of the rated current */
    const int64_t torque_nnm = identify_torque_nnm(
        d, flux, d->params.i_rated_ma * (1000LL / 10 * (d->reluctant ? STEEP_TENTHS : RAMP_TENTHS)));
    d->params.ramp_rpm_s = identify_within(scale(torque_nnm, 60000, TWO_PI_E9 / 1000000 * inertia), 1000000);
    return identify_tune_turning(d, IDENTIFY_NOT_PUSHED);
}

/* ==== constant speeds ==== */

/*
 * Constant speeds, w1 = w2 / 3 and w2, in both directions:
 *
 *     1.5 p psi i_q = Tc sign w + B w + load        v_d = R i_d + w psi sin x - w Lq i_q
 *
 * The part of i_q that changes sign with the direction is friction, the rest is load. The part of v_d that changes gives the
 * frame's lead x over the rotor. A d current of alternating sign has no mean torque and keeps the phase currents away from
 * zero, where dead-time compensation is poor: without it, current harmonics caused a twentieth of the friction torque.
 */

#define SETTLE_MS     250u
#define BLOCK_MS      40u
#define HALF_MS       (BLOCK_MS * IDENTIFY_BLOCKS / 2u)
#define TURN_ROUND_MS 100u /* settling time of the speed after a change of sign of i_d */
#define ALONG_TENTHS  4    /* of the rated current */
#define TIMEOUT_MS    4000u
#define SLOW_PART     3
#define PAIRS         (IDENTIFY_BLOCKS / 2)
#define STEP_PARTS    3
#define SAMPLING_NS   300 /* found on the bench: up to a third of the dead time */
#define SAMPLES       (IDENTIFY_BLOCKS * (int64_t)BLOCK_MS)
#define LOAD_PART     20 /* of the rated current: a smaller load is ignored */
/* Systematic error of the offset, 0.01 degrees electrical: sample skew, delay of the voltage. */
#define OFFSET_BOUND 50

enum {
    SLOW_FORWARD,
    FAST_FORWARD,
    FAST_BACK,
    SLOW_BACK,
};

/* ---- measuring: each point is a phase ---- */

static int32_t target_rpm(const struct identify *d)
{
    const int32_t slow_rpm = q15_max(d->rpm_max / SLOW_PART, 1);
    const int32_t rpm = d->phase == SLOW_FORWARD || d->phase == SLOW_BACK ? slow_rpm : d->rpm_max;
    return d->phase >= FAST_BACK ? -rpm : rpm;
}

/* With reluctance it would cause torque. */
static int32_t along_q15(const struct identify *d)
{
    const int32_t i_q15 = d->reluctant ? 0 : identify_tenths_q15(d, ALONG_TENTHS);
    return d->work.speeds.measured_ms < HALF_MS ? i_q15 : -i_q15;
}

/* Regulates to the point's speed; true once the reference is reached and the speed has settled. */
static bool settled(struct identify *d, const struct measure_io *io)
{
    struct identify_speeds *const m = &d->work.speeds;
    const bool there = measure_spin(io, target_rpm(d), identify_i_max_q15(d));
    current_loop_set_i_d(io->loop, along_q15(d));
    m->settled_ms = there ? m->settled_ms + 1u : 0u;
    m->waited_ms = there ? 0u : m->waited_ms + 1u;
    return m->settled_ms > SETTLE_MS;
}

static void add(struct identify *d, const struct measure_io *io)
{
    struct identify_speeds *const m = &d->work.speeds;
    struct identify_point *const p = &m->points[d->phase];
    p->i_q[m->measured_ms / BLOCK_MS] += io->loop->i_q_q15;
    p->v_d += io->loop->v_d_q15;
    p->v_q += io->loop->v_q_q15;
    p->x += io->speed->estimate.speed_rpm_q15;
    m->measured_ms++;
    if (m->measured_ms == HALF_MS) {
        m->settled_ms = SETTLE_MS - TURN_ROUND_MS;
    } else if (m->measured_ms == BLOCK_MS * IDENTIFY_BLOCKS) {
        m->measured_ms = 0;
        m->settled_ms = 0;
        identify_enter(d, d->phase + 1u);
    }
}

bool identify_measure_speeds(struct identify *d, const struct measure_io *io)
{
    struct identify_speeds *const m = &d->work.speeds;
    if (d->ms == 1u) {
        m->offset_q32 = io->loop->angle_offset_q32;
        encoder_clear(&io->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
    }
    const bool calm = settled(d, io);
    if (d->phase <= FAST_FORWARD && measure_index(io, &m->index)) {
        m->index_seen = true;
    }
    if (m->waited_ms > TIMEOUT_MS) {
        measure_push(io, 0);
        return true;
    }
    if (calm) {
        add(d, io);
    }
    return d->phase == IDENTIFY_POINTS; /* the map starts at this speed, or the drive stops */
}

/* ---- evaluation ---- */

static int64_t mean_mrad_s(const struct identify_point *p)
{
    return identify_mrad_s(p->x, SAMPLES);
}

static int64_t sum_i_q(const struct identify_point *p)
{
    int64_t sum = 0;
    for (int32_t k = 0; k < IDENTIFY_BLOCKS; k++) {
        sum += p->i_q[k];
    }
    return sum;
}

/* ---- offset ---- */

/* The frame's lead over the rotor, 0.01 degrees electrical, and how much of it comes from Lq. */
struct ahead {
    int64_t e2_deg, cross_e2_deg;
};

/* nV of w Lq i_q. */
static int64_t cross_nv(const struct identify *d, const struct identify_point *p)
{
    const int64_t flux_fwb = identify_ua(d, sum_i_q(p), SAMPLES) * d->results[IDENTIFY_LQ].value;
    return identify_scaled(flux_fwb, mean_mrad_s(p) * d->params.pole_pairs, 1000000000);
}

static struct ahead ahead_of(const struct identify *d, const struct identify_point *forward,
                             const struct identify_point *back)
{
    const int64_t cross_nv_apart = cross_nv(d, forward) - cross_nv(d, back);
    const int64_t apart_nv = identify_nv(d, forward->v_d - back->v_d, SAMPLES) + cross_nv_apart;
    const int64_t w_mrad_s = (mean_mrad_s(forward) - mean_mrad_s(back)) * d->params.pole_pairs;
    const int64_t induced_nv = scale(w_mrad_s < 1 ? 1 : w_mrad_s, d->flux_e1_uwb, 10);
    const int64_t magnets_nv = induced_nv < 1 ? 1 : induced_nv;
    return (struct ahead){identify_scaled(apart_nv, 5730, magnets_nv),
                          identify_scaled(cross_nv_apart, 5730, magnets_nv)};
}

/* Angle of the index. */
static void know_offset(struct identify *d)
{
    const struct identify_speeds *const m = &d->work.speeds;
    const struct ahead fast = ahead_of(d, &m->points[FAST_FORWARD], &m->points[FAST_BACK]);
    const struct ahead slow = ahead_of(d, &m->points[SLOW_FORWARD], &m->points[SLOW_BACK]);
    d->ahead_q32 = (uint32_t)identify_scaled(fast.e2_deg, 1LL << 32, 36000);
    if (!d->indexed) {
        return; /* refused */
    }
    if (!m->index_seen) {
        identify_refuse(d, IDENTIFY_OFFSET, IDENTIFY_OFFSET, IDENTIFY_NO_INDEX);
        return;
    }
    const uint32_t at_q32 = m->offset_q32 - d->ahead_q32 + m->index * d->tuning.encoder_scale_q32;
    const int64_t apart = fast.e2_deg - slow.e2_deg;
    const int64_t bound = identify_root(OFFSET_BOUND * OFFSET_BOUND + apart * apart);
    const int64_t count_e2_deg = scale(36000, d->params.pole_pairs, d->params.encoder_counts);
    identify_set(d, IDENTIFY_OFFSET, (int32_t)scale(at_q32, 36000, 1LL << 32) % 36000,
                 identify_interval(identify_scaled(fast.cross_e2_deg, 1, 5), bound, count_e2_deg));
}

/* ---- friction: measured at one speed in both directions ---- */

struct both_ways {
    const struct identify_point *forward, *back;
};

/* Half the change with direction, from a block with i_d and its twin with -i_d. */
static int64_t friction_nnm(const struct identify *d, struct both_ways at, int32_t pair)
{
    const int64_t *const f = at.forward->i_q, *const b = at.back->i_q;
    const int64_t i_sum = f[pair] + f[pair + PAIRS] - b[pair] - b[pair + PAIRS];
    return identify_torque_nnm(d, d->flux_e1_uwb, identify_ua(d, i_sum, 4 * BLOCK_MS));
}

static bool is_loaded(const struct identify *d, struct both_ways at)
{
    const int64_t load_ua = identify_ua(d, sum_i_q(at.forward) + sum_i_q(at.back), 2 * SAMPLES);
    return identify_size(load_ua) > d->params.i_rated_ma * (1000LL / LOAD_PART);
}

static int64_t speed_mrad_s(struct both_ways at)
{
    return (mean_mrad_s(at.forward) - mean_mrad_s(at.back)) >> 1;
}

/*
 * Error of a torque at these small currents: sensor gains, flux, a third of an ADC step; and the sample's offset from the
 * middle of the current ripple, which increases with EMF over inductance.
 */
static int64_t bound_nnm(const struct identify *d, struct both_ways at)
{
    int64_t sum = 0;
    for (int32_t k = 0; k < PAIRS; k++) {
        sum += friction_nnm(d, at, k);
    }
    const int64_t nnm = identify_size(sum >> 2);
    const int64_t nv = identify_size(identify_nv(d, at.forward->v_q, SAMPLES));
    const int64_t ripple_ua = scale(nv, SAMPLING_NS, (int64_t)d->params.lq_uh * 1000000);
    const int64_t ripple_nnm = identify_torque_nnm(d, d->flux_e1_uwb, ripple_ua);
    const int64_t gain = identify_permille(nnm, IDENTIFY_CURRENT_GAIN_PERMILLE);
    const int64_t flux = scale(nnm, d->results[IDENTIFY_FLUX].interval, d->flux_e1_uwb);
    const int64_t step_nnm = identify_torque_nnm(d, d->flux_e1_uwb, identify_ua(d, BOARD_ADC_Q15_PER_CODE, STEP_PARTS));
    return identify_root(gain * gain + flux * flux + step_nnm * step_nnm + ripple_nnm * ripple_nnm);
}

static void know_if_resolved(struct identify *d, enum identify_quantity what, int64_t value, int64_t interval)
{
    if (2 * interval > value) {
        identify_refuse(d, what, what, IDENTIFY_UNRESOLVED);
    } else {
        identify_set(d, what, value, interval);
    }
}

/* Both from the straight line through two speeds: F = Tc + B w. */
static void know_friction(struct identify *d, struct both_ways slow, struct both_ways fast)
{
    const int64_t slow_mrad_s = speed_mrad_s(slow), fast_mrad_s = speed_mrad_s(fast);
    const int64_t apart_mrad_s = fast_mrad_s - slow_mrad_s;
    if (apart_mrad_s < 1 || slow_mrad_s < 1) {
        identify_refuse(d, IDENTIFY_COULOMB, IDENTIFY_VISCOUS, IDENTIFY_TOO_SLOW);
        return;
    }
    int64_t constant[PAIRS], grows[PAIRS];
    for (int32_t k = 0; k < PAIRS; k++) {
        const int64_t slow_nnm = friction_nnm(d, slow, k);
        const int64_t more_nnm = friction_nnm(d, fast, k) - slow_nnm;
        grows[k] = identify_scaled(more_nnm, 1000, apart_mrad_s);
        constant[k] = slow_nnm - identify_scaled(more_nnm, slow_mrad_s, apart_mrad_s);
    }
    const struct identify_spread coulomb = identify_spread(constant, PAIRS), viscous = identify_spread(grows, PAIRS);
    const int64_t slow_nnm = bound_nnm(d, slow), fast_nnm = bound_nnm(d, fast);
    const int64_t coulomb_nnm = identify_interval(coulomb.deviation, scale(slow_nnm, fast_mrad_s, apart_mrad_s),
                                                  scale(fast_nnm, slow_mrad_s, apart_mrad_s));
    know_if_resolved(d, IDENTIFY_COULOMB, identify_scaled(coulomb.mean, 1, 1000), scale(coulomb_nnm, 1, 1000));
    know_if_resolved(
        d, IDENTIFY_VISCOUS, viscous.mean,
        identify_interval(viscous.deviation, scale(slow_nnm, 1000, apart_mrad_s), scale(fast_nnm, 1000, apart_mrad_s)));
}

/* ---- sequence ---- */

/*
 * A load in one direction may depend on speed; the inertia was measured with it, and with strong reluctance its current
 * saturates the d axis.
 */
static void refuse_loaded(struct identify *d)
{
    identify_refuse(d, d->reluctant ? IDENTIFY_FLUX : IDENTIFY_INERTIA, IDENTIFY_VISCOUS, IDENTIFY_LOADED);
    identify_refuse_rest(d, IDENTIFY_LOADED);
}

enum identify_reason identify_evaluate_speeds(struct identify *d)
{
    const struct identify_point *const p = d->work.speeds.points;
    const struct both_ways slow = {&p[SLOW_FORWARD], &p[SLOW_BACK]}, fast = {&p[FAST_FORWARD], &p[FAST_BACK]};
    if (d->phase < IDENTIFY_POINTS) {
        identify_refuse_rest(d, IDENTIFY_LOADED);
        return IDENTIFY_NO_REASON;
    }
    know_offset(d);
    if (is_loaded(d, fast) || is_loaded(d, slow)) {
        refuse_loaded(d);
    } else if (d->indexed) {
        know_friction(d, slow, fast);
    }
    identify_replace(d);
    return IDENTIFY_NO_REASON;
}
