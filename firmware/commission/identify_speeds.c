/* SPDX-License-Identifier: MIT */
/*
 * Constant speeds, w1 = w2 / 3 and w2, in both directions:
 *
 *     1.5 p psi i_q = Tc sign w + B w + load        v_d = R i_d + w psi sin x - w Lq i_q
 *
 * The part of i_q that changes with direction is friction, the rest is load. The part of v_d that changes gives the angle x
 * by which the frame leads the rotor. A current along the magnets, half the time against them, makes no torque on average
 * and keeps the phase currents away from zero, where dead time is compensated badly: without it, current harmonics made a
 * twentieth of the friction torque.
 */
#include "drivers/fabric/encoder.h"
#include "firmware/commission/identify_parts.h"

#define SETTLE_MS     250u
#define BLOCK_MS      40u
#define HALF_MS       (BLOCK_MS * IDENTIFY_BLOCKS / 2u)
#define TURN_ROUND_MS 100u /* until the speed has settled after i_d changed its sign */
#define ALONG_TENTHS  4    /* of the rated current */
#define PATIENCE_MS   4000u
#define SLOW_PART     3
#define PAIRS         (IDENTIFY_BLOCKS / 2)
#define STEP_PARTS    3
#define SAMPLING_NS   300 /* found on the bench: up to a third of the dead time */
#define SAMPLES       (IDENTIFY_BLOCKS * (int64_t)BLOCK_MS)
#define LOAD_PART     20 /* of the rated current: a smaller load counts as none */
/* Part of the offset that sensors cannot see, 0.01 degrees electrical: sample skew, delay of the voltage. */
#define OFFSET_BOUND 50

enum {
    SLOW_FORTH,
    FAST_FORTH,
    FAST_BACK,
    SLOW_BACK,
};

/* ---- measuring: each point is a phase ---- */

static int32_t target_rpm(const struct identify *d)
{
    const int32_t slow_rpm = q15_max(d->rpm_most / SLOW_PART, 1);
    const int32_t rpm = d->phase == SLOW_FORTH || d->phase == SLOW_BACK ? slow_rpm : d->rpm_most;
    return d->phase >= FAST_BACK ? -rpm : rpm;
}

/* With reluctance it would make a torque. */
static int32_t along_q15(const struct identify *d)
{
    const int32_t i_q15 = d->reluctant ? 0 : identify_tenths_q15(d, ALONG_TENTHS);
    return d->work.speeds.measured_ms < HALF_MS ? i_q15 : -i_q15;
}

/* Regulates towards the point's speed; true as long as the reference is there, and what has swung has calmed down. */
static bool settled(struct identify *d, const struct measure_io *io)
{
    struct identify_speeds *const m = &d->work.speeds;
    const bool there = measure_spin(io, target_rpm(d), identify_i_most_q15(d));
    current_loop_ask_d(io->loop, along_q15(d));
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
    if (d->phase <= FAST_FORTH && measure_index(io, &m->index)) {
        m->index_seen = true;
    }
    if (m->waited_ms > PATIENCE_MS) {
        measure_push(io, 0);
        return true;
    }
    if (calm) {
        add(d, io);
    }
    return d->phase == IDENTIFY_POINTS; /* the map begins at this speed, or the drive goes to rest */
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
    const struct ahead fast = ahead_of(d, &m->points[FAST_FORTH], &m->points[FAST_BACK]);
    const struct ahead slow = ahead_of(d, &m->points[SLOW_FORTH], &m->points[SLOW_BACK]);
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
    identify_know(d, IDENTIFY_OFFSET, (int32_t)scale(at_q32, 36000, 1LL << 32) % 36000,
                  identify_interval(identify_scaled(fast.cross_e2_deg, 1, 5), bound, count_e2_deg));
}

/* ---- friction: what is measured at one speed, both ways ---- */

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
 * Error of a torque at these small currents: sensor gains, flux, a third of an ADC step; and the sample misses the middle of
 * the current ripple, which grows with EMF over inductance.
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
        identify_know(d, what, value, interval);
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

/* ---- all of it ---- */

/*
 * A load that drives the shaft one way may depend on speed in any way; inertia was measured against it, and where reluctance is
 * strong its current saturates the magnets' path.
 */
static void refuse_loaded(struct identify *d)
{
    identify_refuse(d, d->reluctant ? IDENTIFY_FLUX : IDENTIFY_INERTIA, IDENTIFY_VISCOUS, IDENTIFY_LOADED);
    identify_refuse_rest(d, IDENTIFY_LOADED);
}

enum identify_reason identify_think_speeds(struct identify *d)
{
    const struct identify_point *const p = d->work.speeds.points;
    const struct both_ways slow = {&p[SLOW_FORTH], &p[SLOW_BACK]}, fast = {&p[FAST_FORTH], &p[FAST_BACK]};
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
    identify_retake(d);
    return IDENTIFY_NO_REASON;
}
