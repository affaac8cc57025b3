/* SPDX-License-Identifier: MIT */
/*
 * Resistance and the dead-time error. A current I along one phase returns half through each of the other two; each leg loses
 * a voltage that depends only on its own current. Above i_c = 2 Q / Td, where the current swings the node within the dead
 * time, that is V0 - c / |i|: Q is the output charge of a switch, and the edge that the current swings gives back Q / i of the
 * dead time (docs/plant.md: edges). So the voltage along the phase, without any compensation, is
 *
 *     u(I) = R I + 2/3 (V0 - c / I) + 2/3 (V0 - 2 c / I) = R I + 4/3 V0 - 2 c / I
 *
 * and three unknowns are fitted to currents in tenths of rated, except the smallest. The levels go from the largest down and
 * back up, so a warming winding shows the same mean at each; the field goes round in steps of 60 degrees, so each phase
 * carries both signs. The rotor is led along softly, since a swinging one induces a voltage.
 */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"
#include "lib/pi.h"

#define SIXTH_Q32 0x2AAAAAABu
#define VISITS    (2u * IDENTIFY_LEVELS)
#define MOVE_MS   300u
#define REST_MS   120u
#define MEAN_MS   10u

/* Shorted windings brake a rotor that swung about the first current, until it has rested so long; and for how long at most. */
#define BRAKE_MS      400u
#define BRAKE_MOST_MS 4000u

/* Of the levels, and of the ADC's steps in the smallest that is used. */
#define FIRST_LEVEL 2
#define LEAST_LSB   8

/* Encoder counts that a rotor at rest may move in total. */
#define DRIFT_COUNTS 16

#define DEAD_BOUND_E1_NS 200 /* the bus drops within a period, unseen by the sample, and bends u(I) by this much */

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

/* s^2 (3 - 2 s), s = 0...1: no jolt. */
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
        current_loop_ask_d(c, measure_ramp(current_q15(d, IDENTIFY_LEVELS), d->phase_ms, MOVE_MS));
    }
    if (d->phase_ms == MOVE_MS + REST_MS) {
        identify_enter(d, STANDS);
    }
}

static void stand(struct identify *d, volatile struct current_loop *c)
{
    struct identify_resistance *const m = &d->work.resistance;
    const int32_t level = level_of(m->visit);
    current_loop_ask_d(c, current_q15(d, level));
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

/* A heavy rotor takes its time. Without an encoder nothing shows it. */
static bool resistance_rests(struct identify *d)
{
    if (d->counts != d->work.resistance.from) {
        d->work.resistance.from = d->counts;
        identify_enter(d, d->phase);
    }
    return d->phase_ms >= BRAKE_MS || d->ms >= BRAKE_MOST_MS;
}

bool identify_measure_resistance(struct identify *d, const struct measure_io *io)
{
    struct identify_resistance *const m = &d->work.resistance;
    volatile struct current_loop *const c = io->loop;
    if (d->reluctant) {
        current_loop_hold_d(c, 0); /* each step of the current would turn it */
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

/* Of each angle, from the levels on the way down (0) and up (1). */
struct solution {
    int64_t slopes[2][IDENTIFY_ANGLES], delays[2][IDENTIFY_ANGLES];
};

static void solve(const struct identify *d, struct solution *s)
{
    const struct identify_resistance *const m = &d->work.resistance;
    const int64_t vbus_q15 = scale(m->vbus_sum_q15, 1, (int64_t)IDENTIFY_ANGLES * VISITS * MEAN_MS);
    for (int32_t k = 0; k < 2 * IDENTIFY_ANGLES; k++) {
        const int32_t way = k / IDENTIFY_ANGLES, angle = k % IDENTIFY_ANGLES;
        int64_t y[IDENTIFY_LEVELS];
        for (int32_t n = 0; n < IDENTIFY_LEVELS; n++) {
            y[n] = identify_scaled(m->v_sum[way][angle][n], 1, MEAN_MS);
        }
        const struct fit fit = fit_levels(y);
        s->slopes[way][angle] = uohm(d, fit.slope);
        s->delays[way][angle] = tenth_ns(fit.constant, vbus_q15);
    }
}

/* Mean of both ways, and half their difference, which a rotor that moves with the current causes. */
struct ways {
    struct identify_spread mean;
    int64_t apart;
};

static struct ways both(int64_t of[2][IDENTIFY_ANGLES])
{
    int64_t mean[IDENTIFY_ANGLES];
    for (int32_t k = 0; k < IDENTIFY_ANGLES; k++) {
        mean[k] = (of[0][k] + of[1][k]) >> 1;
    }
    const int64_t apart = identify_spread(of[0], IDENTIFY_ANGLES).mean - identify_spread(of[1], IDENTIFY_ANGLES).mean;
    return (struct ways){identify_spread(mean, IDENTIFY_ANGLES), identify_size(apart) >> 1};
}

static void know(struct identify *d, const struct ways *r, const struct ways *delay)
{
    const int64_t gain = identify_permille(r->mean.mean, IDENTIFY_CURRENT_GAIN_PERMILLE);
    const int64_t bus = identify_permille(r->mean.mean, IDENTIFY_BUS_GAIN_PERMILLE);
    const int64_t gains = identify_root(gain * gain + bus * bus);
    identify_know(d, IDENTIFY_RESISTANCE, r->mean.mean, identify_interval(r->mean.deviation, gains, 2 * r->apart));
    identify_know(d, IDENTIFY_DEAD_TIME, delay->mean.mean,
                  identify_interval(delay->mean.deviation, DEAD_BOUND_E1_NS, 2 * delay->apart));
    d->params.resistance_mohm = identify_within(scale(r->mean.mean, 1, 1000), 100000);
}

/* The field leads the rotor; a rotor that moves on while the field stands is driven. Without an encoder no motion shows. */
static bool resistance_driven(const struct identify_resistance *m)
{
    return q15_abs(m->drifted) > q15_abs(m->led) / 2 + DRIFT_COUNTS;
}

static enum identify_reason resistance_judge(struct identify *d)
{
    if (d->reluctant) {
        return IDENTIFY_TURNED;
    }
    if (current_q15(d, FIRST_LEVEL) < LEAST_LSB * BOARD_ADC_Q15_PER_CODE) {
        return IDENTIFY_RATED_SMALL;
    }
    struct solution s;
    solve(d, &s);
    const struct ways r = both(s.slopes), delay = both(s.delays);
    if (r.mean.mean <= 0) {
        return IDENTIFY_NOT_RESISTIVE;
    }
    if (identify_scatters(&r.mean) || r.apart * 10 > r.mean.mean) {
        return IDENTIFY_SCATTER;
    }
    know(d, &r, &delay);
    return IDENTIFY_NO_REASON;
}

enum identify_reason identify_think_resistance(struct identify *d)
{
    if (!d->reluctant && resistance_driven(&d->work.resistance)) {
        return IDENTIFY_LOADED;
    }
    const enum identify_reason against = resistance_judge(d);
    if (against != IDENTIFY_NO_REASON) {
        identify_refuse(d, IDENTIFY_RESISTANCE, IDENTIFY_DEAD_TIME, against);
    }
    /* the inductances do not need it */
    return against == IDENTIFY_RATED_SMALL || against == IDENTIFY_NOT_RESISTIVE ? IDENTIFY_STOPPED : IDENTIFY_NO_REASON;
}
