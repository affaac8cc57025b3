/* SPDX-License-Identifier: MIT */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"
#include "lib/pi.h"

/* ==== first values ==== */

/*
 * A first inductance and a first resistance, to within a third: enough to regulate a current, which all later measurements
 * need. Pulses along each phase increase until they drive 1/12 of the rated current; then a loop that is stable with any
 * resistance regulates half the rated current, and its voltage is measured.
 */

#define THIRD_Q32   0x55555555u
#define FIRST_STEPS (CONFIG_BUS_STEPS / 1024)
#define MAX_STEPS   (CONFIG_BUS_STEPS / 4)
#define PULSES_EACH 4u
#define MIN_Q15     24 /* one and a half of the ADC's steps, of the mean of many */
#define RATED_PART  12
/* Close to the dead-time error small inductances seem salient: at least three times that, or a quarter of the rated current. */
#define BEYOND_STEPS (CONFIG_DEAD_COUNTS * 3 / 2 << CONFIG_V_SHIFT)
#define BEYOND_PART  4 /* there twice the voltage may drive four times the current */

#define HOLD_HZ      100 /* crossover, and ratio of crossover to the loop's zero */
#define HOLD_ZERO    4
#define RAMP_MS      50
#define SETTLE_MS    300u
#define HOLD_MEAN_MS 64u

/* Of the resistance measurement: crossover, and settling time of each current step: longer with slow iron. */
#define REGULATE_HZ   250
#define MIN_SETTLE_MS 10
#define MAX_SETTLE_MS 60

#define MAX_UH   1000000
#define MAX_MOHM 100000

/* ---- pulses ---- */

static bool rough_grow(struct burst *b)
{
    if (b->v_steps * 2 <= MAX_STEPS) {
        b->v_steps *= 2;
        return true;
    }
    const bool longer = b->hold == 1 && BURST_LENGTH > 4;
    b->hold = longer ? BURST_LENGTH / 4 : b->hold;
    return longer;
}

static bool is_enough(const struct identify *d, const struct burst *b)
{
    const int32_t peak_q15 = burst_peak_q15(b);
    return peak_q15 * BEYOND_PART >= d->i_rated_q15 ||
           (peak_q15 * RATED_PART >= d->i_rated_q15 && b->v_steps >= BEYOND_STEPS);
}

bool identify_measure_pulses(struct identify *d, const struct measure_io *io)
{
    struct identify_pulses *const m = &d->work.pulses;
    struct burst *const b = &d->burst;
    if (d->ms == 1u) {
        *b = (struct burst){.v_steps = FIRST_STEPS, .hold = 1};
        return false;
    }
    const uint32_t phase = m->count % 3u;
    current_loop_field(io->loop, phase * THIRD_Q32, 0);
    identify_play(d, io, phase * THIRD_Q32, phase * THIRD_Q32);
    if (m->count == 0u && !is_enough(d, b) && rough_grow(b)) {
        return false;
    }
    burst_add(&m->sums[phase], b, io->loop->vbus_q15);
    m->count++;
    return m->count == 3u * PULSES_EACH;
}

/* The change of current by one sample's voltage, 256ths of Q15: the largest of three angles, where the inductance is least. */
static int64_t change_256ths(const struct identify_pulses *m)
{
    int64_t largest = 0;
    for (uint32_t k = 0; k < 3u; k++) {
        const int64_t change = identify_scaled(m->sums[k].ud, 256, m->sums[k].count);
        largest = change > largest ? change : largest;
    }
    return largest;
}

/* Three angles give the second harmonic over the angle. */
static bool is_reluctant(const struct identify_pulses *m)
{
    struct measure_axes axes = {0};
    for (uint32_t k = 0; k < 3u; k++) {
        measure_axes_add(&axes, k * THIRD_Q32, m->sums[k].ud, m->sums[k].uq);
    }
    return identify_doubled(&axes);
}

enum identify_reason identify_evaluate_pulses(struct identify *d)
{
    const struct identify_pulses *const m = &d->work.pulses;
    const int64_t change = change_256ths(m);
    if (change < MIN_Q15 * 256 / 4) {
        identify_refuse(d, IDENTIFY_RESISTANCE, IDENTIFY_LQ, IDENTIFY_NO_CURRENT);
        return IDENTIFY_STOPPED;
    }
    d->reluctant = is_reluctant(m);
    d->bus_nv = identify_nv(d, m->sums[0].vbus_q15, m->sums[0].bursts);
    /* L = U Ts / change */
    const int64_t l_uh =
        scale(identify_wave_uv(d, &m->sums[0]), 1000000000LL / CONFIG_PWM_HZ, identify_change_na(d, change));
    d->params.ld_uh = d->params.lq_uh = identify_within(l_uh, MAX_UH);
    /* ki / kp = w / HOLD_ZERO: as if R were L times so much */
    d->params.resistance_mohm =
        identify_within(scale(d->params.ld_uh, 6283LL * HOLD_HZ / HOLD_ZERO, 1000000), MAX_MOHM);
    return identify_tune(d, HOLD_HZ);
}

/* ---- constant current ---- */

bool identify_measure_hold(struct identify *d, const struct measure_io *io)
{
    struct identify_hold *const m = &d->work.hold;
    volatile struct current_loop *const c = io->loop;
    if (d->ms == 1u) {
        current_loop_field(c, 0, 0);
    }
    current_loop_set_i_d(c, measure_ramp(d->i_rated_q15 / 2, d->ms, RAMP_MS));
    if (d->ms > SETTLE_MS) {
        m->v_sum += (int64_t)c->v_d_steps * c->vbus_q15;
        m->i_sum_q15 += c->i_d_q15;
        m->count++;
    }
    return d->ms == SETTLE_MS + HOLD_MEAN_MS;
}

enum identify_reason identify_evaluate_hold(struct identify *d)
{
    const struct identify_hold *const m = &d->work.hold;
    if (m->v_sum <= 0 || m->i_sum_q15 < m->count * (d->i_rated_q15 / 4)) {
        identify_refuse(d, IDENTIFY_RESISTANCE, IDENTIFY_DEAD_TIME, IDENTIFY_NO_CURRENT);
        return IDENTIFY_STOPPED;
    }
    const int64_t u_uv = scale(m->v_sum, d->params.v_range_mv * 1000LL, 32768LL * CONFIG_BUS_STEPS * m->count);
    const int64_t r_mohm = scale(u_uv, 1000, identify_ua(d, m->i_sum_q15, m->count));
    /* the loop's zero at a quarter of its crossover, or at the winding's pole: limits the settling time */
    const int64_t quick_mohm = scale(d->params.ld_uh, 6283LL * REGULATE_HZ / 4, 1000000);
    const int64_t tau_ms = scale(d->params.ld_uh, 1, r_mohm < 1 ? 1 : r_mohm);
    d->rough_mohm = (int32_t)(r_mohm < MAX_MOHM ? r_mohm : MAX_MOHM);
    d->params.resistance_mohm = identify_within(r_mohm > quick_mohm ? r_mohm : quick_mohm, MAX_MOHM);
    d->settle_ms = MIN_SETTLE_MS + (uint32_t)(tau_ms < MAX_SETTLE_MS ? tau_ms : MAX_SETTLE_MS);
    return identify_tune(d, REGULATE_HZ);
}

/* ==== the resistance ==== */

/*
 * Resistance and the dead-time error. A current I along one phase returns half through each of the other two; each leg loses a
 * voltage that depends only on its own current. Above i_c = 2 Q / Td, where the current commutates the node within the dead
 * time, that is V0 - c / |i|: Q is the output charge of a switch, and that edge recovers Q / i of the dead time (docs/plant.md:
 * edges). So the voltage along the phase, without any compensation, is
 *
 *     u(I) = R I + 2/3 (V0 - c / I) + 2/3 (V0 - 2 c / I) = R I + 4/3 V0 - 2 c / I
 *
 * and three unknowns are fitted to currents in tenths of rated, except the smallest. The levels go from the largest down and
 * back up, so that warming of the winding affects all means equally; the field moves in steps of 60 degrees, so that each phase
 * has both signs. The field moves smoothly, since an oscillating rotor has an EMF.
 */

#define SIXTH_Q32 0x2AAAAAABu
#define VISITS    (2u * IDENTIFY_LEVELS)
#define MOVE_MS   300u
#define REST_MS   120u
#define MEAN_MS   10u

/* Shorted windings brake the rotor after the first current: time at rest required, and time-out. */
#define BRAKE_MS     400u
#define BRAKE_MAX_MS 4000u

/* Of the levels, and of the ADC's steps in the smallest that is used. */
#define FIRST_LEVEL 2
#define MIN_LSB     8

/* Encoder counts that a rotor at rest may move in total. */
#define DRIFT_COUNTS 16

#define DEAD_BOUND_E1_NS 200 /* nonlinearity of u(I) by the drop of the bus voltage within a period */

/* Unit for the inverse of a level; all levels divide it. */
#define INVERSE 2520

/* ---- measuring ---- */

enum { MOVES, STANDS };

static int32_t level_of(uint32_t visit)
{
    return (int32_t)(visit < IDENTIFY_LEVELS ? IDENTIFY_LEVELS - visit : visit - IDENTIFY_LEVELS + 1u);
}

static int32_t current_q15(const struct identify *d, int32_t level)
{
    return d->i_rated_q15 * level / IDENTIFY_LEVELS;
}

/* s^2 (3 - 2 s), s = 0...1: smooth start and end. */
static uint32_t soft_q16(uint32_t ms)
{
    const int32_t s_q10 = measure_ramp(1024, ms, MOVE_MS);
    return (uint32_t)(s_q10 * s_q10 / 16 * (3 * 1024 - 2 * s_q10) / 1024);
}

/* The field turns to the angle at full current, and the rotor settles. At the first one the current rises. */
static void move(struct identify *d, volatile struct current_loop *c)
{
    const uint32_t angle = d->work.resistance.angle;
    const uint32_t from_q32 = (angle == 0u ? 0u : angle - 1u) * SIXTH_Q32;
    const uint32_t way_q32 = angle == 0u ? 0u : (SIXTH_Q32 >> 16) * soft_q16(d->phase_ms);
    current_loop_field(c, d->phase_ms >= MOVE_MS ? angle * SIXTH_Q32 : from_q32 + way_q32, 0);
    if (angle == 0u) {
        current_loop_set_i_d(c, measure_ramp(current_q15(d, IDENTIFY_LEVELS), d->phase_ms, MOVE_MS));
    }
    if (d->phase_ms == MOVE_MS + REST_MS) {
        identify_enter(d, STANDS);
    }
}

static void stand(struct identify *d, volatile struct current_loop *c)
{
    struct identify_resistance *const m = &d->work.resistance;
    const int32_t level = level_of(m->visit);
    current_loop_set_i_d(c, current_q15(d, level));
    if (d->phase_ms > d->settle_ms) {
        m->v_sum[m->visit / IDENTIFY_LEVELS][m->angle][level - 1] +=
            (int64_t)(c->integral_d_q9 >> PI_SHIFT) * c->vbus_q15;
        m->vbus_sum_q15 += c->vbus_q15;
    }
    if (d->phase_ms < d->settle_ms + MEAN_MS) {
        return;
    }
    m->visit = (m->visit + 1u) % VISITS;
    m->angle += m->visit == 0u ? 1u : 0u;
    identify_enter(d, m->visit == 0u ? MOVES : STANDS);
}

/* Waits for a heavy rotor to come to rest, as far as the encoder shows it. */
static bool resistance_rests(struct identify *d)
{
    if (d->counts != d->work.resistance.from) {
        d->work.resistance.from = d->counts;
        identify_enter(d, d->phase);
    }
    return d->phase_ms >= BRAKE_MS || d->ms >= BRAKE_MAX_MS;
}

bool identify_measure_resistance(struct identify *d, const struct measure_io *io)
{
    struct identify_resistance *const m = &d->work.resistance;
    volatile struct current_loop *const c = io->loop;
    if (d->reluctant) {
        current_loop_hold_d(c, 0); /* each current step would turn it */
        return resistance_rests(d);
    }
    *(d->phase == MOVES ? &m->led : &m->drifted) += d->ms == 1u ? 0 : d->counts - m->from;
    m->from = d->counts;
    if (d->phase == MOVES) {
        move(d, c);
    } else {
        stand(d, c);
    }
    const bool done = m->angle == IDENTIFY_ANGLES;
    current_loop_compensate(c, done);
    return done;
}

/* ---- evaluation ---- */

/* y = slope n + constant + hyperbola / n over the levels from the first valid one, by least squares and Cramer's rule. */
struct fit {
    int64_t slope, constant; /* of y, with 8 more bits */
};

static struct fit fit_levels(const int64_t y[IDENTIFY_LEVELS])
{
    int64_t count = 0, n1 = 0, n2 = 0, q1 = 0, q2 = 0, y0 = 0, yn = 0, yq = 0;
    for (int32_t n = FIRST_LEVEL; n <= IDENTIFY_LEVELS; n++) {
        const int64_t q = INVERSE / n;
        count++;
        n1 += n;
        n2 += (int64_t)n * n;
        q1 += q;
        q2 += q * q;
        y0 += y[n - 1];
        yn += y[n - 1] * n;
        yq += y[n - 1] * q;
    }
    const int64_t nq = count * INVERSE;
    /* rows: (n2 n1 nq | yn), (n1 count q1 | y0), (nq q1 q2 | yq) */
    const int64_t a = count * q2 - q1 * q1, b = n1 * q2 - q1 * nq, e = n1 * q1 - count * nq;
    const int64_t determinant = n2 * a - n1 * b + nq * e;
    const int64_t slope = yn * a - y0 * b + yq * e;
    const int64_t constant = -yn * b + y0 * (n2 * q2 - nq * nq) - yq * (n2 * q1 - n1 * nq);
    return (struct fit){identify_scaled(slope, 256, determinant), identify_scaled(constant, 256, determinant)};
}

/* uohm from a slope per level, which has 8 more bits: y is steps times the bus voltage in Q15. */
static int64_t uohm(const struct identify *d, int64_t slope)
{
    const int64_t level_ua = identify_ua(d, d->i_rated_q15, IDENTIFY_LEVELS);
    const int64_t level_nv = identify_nv(d, slope, 256LL * CONFIG_BUS_STEPS);
    return identify_scaled(level_nv, 1000, level_ua);
}

/* 0.1 ns from a constant, 4/3 of a leg's loss: as part of the bus voltage, times the period. */
static int64_t tenth_ns(int64_t constant, int64_t vbus_q15)
{
    return identify_scaled(constant, 3LL * 10000000000 / 4 / CONFIG_PWM_HZ, 256LL * CONFIG_BUS_STEPS * vbus_q15);
}

/* Of each angle, from decreasing (0) and increasing (1) levels. */
struct solution {
    int64_t slopes[2][IDENTIFY_ANGLES], delays[2][IDENTIFY_ANGLES];
};

static void solve(const struct identify *d, struct solution *s)
{
    const struct identify_resistance *const m = &d->work.resistance;
    const int64_t vbus_q15 = scale(m->vbus_sum_q15, 1, (int64_t)IDENTIFY_ANGLES * VISITS * MEAN_MS);
    for (int32_t k = 0; k < 2 * IDENTIFY_ANGLES; k++) {
        const int32_t pass = k / IDENTIFY_ANGLES, angle = k % IDENTIFY_ANGLES;
        int64_t y[IDENTIFY_LEVELS];
        for (int32_t n = 0; n < IDENTIFY_LEVELS; n++) {
            y[n] = identify_scaled(m->v_sum[pass][angle][n], 1, MEAN_MS);
        }
        const struct fit fit = fit_levels(y);
        s->slopes[pass][angle] = uohm(d, fit.slope);
        s->delays[pass][angle] = tenth_ns(fit.constant, vbus_q15);
    }
}

/* Mean of decreasing and increasing levels, and half their difference, which is caused by motion of the rotor. */
struct passes {
    struct identify_spread mean;
    int64_t apart;
};

static struct passes both(int64_t of[2][IDENTIFY_ANGLES])
{
    int64_t mean[IDENTIFY_ANGLES];
    for (int32_t k = 0; k < IDENTIFY_ANGLES; k++) {
        mean[k] = (of[0][k] + of[1][k]) >> 1;
    }
    const int64_t apart = identify_spread(of[0], IDENTIFY_ANGLES).mean - identify_spread(of[1], IDENTIFY_ANGLES).mean;
    return (struct passes){identify_spread(mean, IDENTIFY_ANGLES), identify_size(apart) >> 1};
}

static void know(struct identify *d, const struct passes *r, const struct passes *delay)
{
    const int64_t gain = identify_permille(r->mean.mean, IDENTIFY_CURRENT_GAIN_PERMILLE);
    const int64_t bus = identify_permille(r->mean.mean, IDENTIFY_BUS_GAIN_PERMILLE);
    const int64_t gains = identify_root(gain * gain + bus * bus);
    identify_set(d, IDENTIFY_RESISTANCE, r->mean.mean, identify_interval(r->mean.deviation, gains, 2 * r->apart));
    identify_set(d, IDENTIFY_DEAD_TIME, delay->mean.mean,
                 identify_interval(delay->mean.deviation, DEAD_BOUND_E1_NS, 2 * delay->apart));
    d->params.resistance_mohm = identify_within(scale(r->mean.mean, 1, 1000), 100000);
}

/* A rotor that moves while the field is fixed is driven by a load. Needs an encoder. */
static bool resistance_driven(const struct identify_resistance *m)
{
    return q15_abs(m->drifted) > q15_abs(m->led) / 2 + DRIFT_COUNTS;
}

static enum identify_reason resistance_judge(struct identify *d)
{
    if (d->reluctant) {
        return IDENTIFY_TURNED;
    }
    if (current_q15(d, FIRST_LEVEL) < MIN_LSB * BOARD_ADC_Q15_PER_CODE) {
        return IDENTIFY_RATED_SMALL;
    }
    struct solution s;
    solve(d, &s);
    const struct passes r = both(s.slopes), delay = both(s.delays);
    if (r.mean.mean <= 0) {
        return IDENTIFY_NOT_RESISTIVE;
    }
    if (identify_scatters(&r.mean) || r.apart * 10 > r.mean.mean) {
        return IDENTIFY_SCATTER;
    }
    know(d, &r, &delay);
    return IDENTIFY_NO_REASON;
}

enum identify_reason identify_evaluate_resistance(struct identify *d)
{
    if (!d->reluctant && resistance_driven(&d->work.resistance)) {
        return IDENTIFY_LOADED;
    }
    const enum identify_reason against = resistance_judge(d);
    if (against != IDENTIFY_NO_REASON) {
        identify_refuse(d, IDENTIFY_RESISTANCE, IDENTIFY_DEAD_TIME, against);
    }
    /* not needed for the inductances */
    return against == IDENTIFY_RATED_SMALL || against == IDENTIFY_NOT_RESISTIVE ? IDENTIFY_STOPPED : IDENTIFY_NO_REASON;
}
