/* SPDX-License-Identifier: MIT */
/*
 * A first inductance and a first resistance, to within a third: enough to regulate a current, which all later measurements
 * need. Pulses along each phase grow until they drive a twelfth of the rated current; then a loop that is stable with any
 * resistance holds half the rated current, and the voltage it takes is measured.
 */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"

#define THIRD_Q32   0x55555555u
#define FIRST_STEPS (CONFIG_BUS_STEPS / 1024)
#define MOST_STEPS  (CONFIG_BUS_STEPS / 4)
#define PULSES_EACH 4u
#define LEAST_Q15   24 /* one and a half of the ADC's steps, of the mean of many */
#define RATED_PART  12
/* Near what dead time takes, small inductances look as if they were salient: thrice that, or a quarter of the rated current. */
#define BEYOND_STEPS (CONFIG_DEAD_COUNTS * 3 / 2 << CONFIG_V_SHIFT)
#define BEYOND_PART  4 /* there twice the voltage may draw four times as much */

#define HOLD_HZ   100 /* crossover, and by how much the loop's zero lies below it */
#define HOLD_ZERO 4
#define RAMP_MS   50
#define SETTLE_MS 300u
#define MEAN_MS   64u

/* Of the resistance: crossover, and how long each step of current is waited for: longer where the iron is slow. */
#define REGULATE_HZ     250
#define LEAST_SETTLE_MS 10
#define MOST_SETTLE_MS  60

#define MOST_UH   1000000
#define MOST_MOHM 100000

/* ---- pulses ---- */

static bool rough_grow(struct burst *b)
{
    if (b->v_steps * 2 <= MOST_STEPS) {
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

/* Three angles tell what goes round twice in a turn. */
static bool is_reluctant(const struct identify_pulses *m)
{
    struct measure_axes axes = {0};
    for (uint32_t k = 0; k < 3u; k++) {
        measure_axes_add(&axes, k * THIRD_Q32, m->sums[k].ud, m->sums[k].uq);
    }
    return identify_doubled(&axes);
}

enum identify_reason identify_think_pulses(struct identify *d)
{
    const struct identify_pulses *const m = &d->work.pulses;
    const int64_t change = change_256ths(m);
    if (change < LEAST_Q15 * 256 / 4) {
        identify_refuse(d, IDENTIFY_RESISTANCE, IDENTIFY_LQ, IDENTIFY_NO_CURRENT);
        return IDENTIFY_STOPPED;
    }
    d->reluctant = is_reluctant(m);
    d->bus_nv = identify_nv(d, m->sums[0].vbus_q15, m->sums[0].bursts);
    /* L = U Ts / change */
    const int64_t l_uh =
        scale(identify_wave_uv(d, &m->sums[0]), 1000000000LL / CONFIG_PWM_HZ, identify_change_na(d, change));
    d->params.ld_uh = d->params.lq_uh = identify_within(l_uh, MOST_UH);
    /* ki / kp = w / HOLD_ZERO: as if R were L times so much */
    d->params.resistance_mohm =
        identify_within(scale(d->params.ld_uh, 6283LL * HOLD_HZ / HOLD_ZERO, 1000000), MOST_MOHM);
    return identify_tune(d, HOLD_HZ);
}

/* ---- a current that stands ---- */

bool identify_measure_hold(struct identify *d, const struct measure_io *io)
{
    struct identify_hold *const m = &d->work.hold;
    volatile struct current_loop *const c = io->loop;
    if (d->ms == 1u) {
        current_loop_field(c, 0, 0);
    }
    current_loop_ask_d(c, measure_ramp(d->i_rated_q15 / 2, d->ms, RAMP_MS));
    if (d->ms > SETTLE_MS) {
        m->v_sum += (int64_t)c->v_d_steps * c->vbus_q15;
        m->i_sum_q15 += c->i_d_q15;
        m->count++;
    }
    return d->ms == SETTLE_MS + MEAN_MS;
}

enum identify_reason identify_think_hold(struct identify *d)
{
    const struct identify_hold *const m = &d->work.hold;
    if (m->v_sum <= 0 || m->i_sum_q15 < m->count * (d->i_rated_q15 / 4)) {
        identify_refuse(d, IDENTIFY_RESISTANCE, IDENTIFY_DEAD_TIME, IDENTIFY_NO_CURRENT);
        return IDENTIFY_STOPPED;
    }
    const int64_t u_uv = scale(m->v_sum, d->params.v_range_mv * 1000LL, 32768LL * CONFIG_BUS_STEPS * m->count);
    const int64_t r_mohm = scale(u_uv, 1000, identify_ua(d, m->i_sum_q15, m->count));
    /* the loop's zero at a quarter of its crossover, or where the winding's own is: so nothing lasts longer than this */
    const int64_t quick_mohm = scale(d->params.ld_uh, 6283LL * REGULATE_HZ / 4, 1000000);
    const int64_t tau_ms = scale(d->params.ld_uh, 1, r_mohm < 1 ? 1 : r_mohm);
    d->rough_mohm = (int32_t)(r_mohm < MOST_MOHM ? r_mohm : MOST_MOHM);
    d->params.resistance_mohm = identify_within(r_mohm > quick_mohm ? r_mohm : quick_mohm, MOST_MOHM);
    d->settle_ms = LEAST_SETTLE_MS + (uint32_t)(tau_ms < MOST_SETTLE_MS ? tau_ms : MOST_SETTLE_MS);
    return identify_tune(d, REGULATE_HZ);
}
