/* SPDX-License-Identifier: MIT */
/*
 * The rotor swings between two speeds, driven by one current in alternating directions. Passing the same speeds once gaining
 * and once slowing down, friction and load are the same but the torques differ: J = (T1 - T2) / (a1 - a2), whatever the
 * friction. The flux that makes the torque is that of this current, from the voltage over the speed of these very ramps.
 */
#include "firmware/commission/identify_parts.h"

#define PATIENCE_MS  5000u
#define SLOW_TENTHS  2 /* of the largest speed: between these two a run is taken */
#define FAST_TENTHS  9
#define FEW_RAMPS    4 /* of a reluctant machine, whose ramps are long */
#define PAIRS_MOST   (IDENTIFY_RAMPS - 1)
#define LEAD_MS      300u
#define LEAST_E1_UWB 100

#define FRAME_MRAD 60 /* 3.4 degrees */

/* Of the flux, at rated current: machines of the bench lose 2 to 4 % at 1.5 times that. */
#define SATURATION_PERMILLE 50

static uint32_t ramps(const struct identify *d)
{
    return d->reluctant ? FEW_RAMPS : IDENTIFY_RAMPS;
}

/* ---- measuring ---- */

/* Speeds as this ramp sees them grow: from -most to most. */
static void accelerate(struct identify *d, const struct measure_io *io)
{
    struct identify_ramps *const m = &d->work.ramps;
    const int32_t sign = d->phase % 2u == 0u ? 1 : -1;
    const int32_t most_q15 = d->rpm_most * 32768;
    const int32_t x_q15 = io->speed->estimate.speed_rpm_q15 * sign;
    const int32_t slow_q15 = most_q15 / 10 * SLOW_TENTHS, fast_q15 = most_q15 / 10 * FAST_TENTHS;
    measure_push(io, sign * d->ramp_i_q15);
    if (q15_abs(x_q15) > slow_q15 && q15_abs(x_q15) < fast_q15) {
        measure_run_add(x_q15 > 0 ? &m->gains[d->phase] : &m->slows[d->phase], io, io->loop->v_q_q15);
    }
    if (x_q15 >= most_q15) {
        identify_enter(d, d->phase + 1u);
        speed_loop_reset(io->speed, 0);
    }
}

/*
 * Where only a small current lets the offset be known, a constant speed has one: the frame is put right there. True when
 * it is.
 */
static bool ramps_lead(struct identify *d, const struct measure_io *io)
{
    struct identify_ramps *const m = &d->work.ramps;
    if (!d->reluctant || m->led_ms >= LEAD_MS) {
        return true;
    }
    m->led_ms = measure_spin(io, -d->rpm_most, identify_i_most_q15(d)) ? m->led_ms + 1u : 0u;
    return false;
}

bool identify_measure_ramps(struct identify *d, const struct measure_io *io)
{
    identify_correct_offset(d, io);
    if (!ramps_lead(d, io)) {
        return d->phase_ms > PATIENCE_MS;
    }
    if (d->phase == ramps(d)) {
        return identify_stop_rotor(d, io, PATIENCE_MS);
    }
    accelerate(d, io);
    return d->phase_ms > PATIENCE_MS;
}

/* ---- evaluation ---- */

/*
 * Of a ramp: slowing down and gaining speed, one current flows, so resistance and dead time are one intercept. Speeds of both
 * signs are a lever three times as long as those of one.
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

/* In a frame that is off, the current across makes some flux along: nH by mrad by uA, 1e-18 Wb. */
static int64_t salient_e1_uwb(const struct identify *d)
{
    const int64_t difference_nh = identify_size(d->results[IDENTIFY_LQ].value - d->results[IDENTIFY_LD].value);
    return scale(difference_nh * FRAME_MRAD, identify_ua(d, d->ramp_i_q15, 1), 100000000000LL);
}

static enum identify_reason ramps_know_flux(struct identify *d)
{
    const struct identify_ramps *const m = &d->work.ramps;
    const uint32_t first = d->reluctant ? 0u : 1u; /* the very first begins at rest, if it is not led */
    int64_t of[IDENTIFY_RAMPS];
    for (uint32_t k = first; k < ramps(d); k++) {
        of[k] = flux_e1_uwb(d, &m->slows[k], &m->gains[k]);
    }
    const struct identify_spread flux = identify_spread(of + first, (int32_t)(ramps(d) - first));
    if (flux.mean < LEAST_E1_UWB || identify_scatters(&flux)) {
        return flux.mean < LEAST_E1_UWB ? IDENTIFY_TOO_SLOW : IDENTIFY_SCATTER;
    }
    d->flux_e1_uwb = (int32_t)flux.mean;
    /* what saturation takes of it grows with the square of the current across */
    const int64_t squared = scale((int64_t)d->ramp_i_q15 * d->ramp_i_q15, SATURATION_PERMILLE * 1000LL,
                                  (int64_t)d->i_rated_q15 * d->i_rated_q15);
    const int64_t gain_e1_uwb = identify_permille(flux.mean, IDENTIFY_BUS_GAIN_PERMILLE);
    const int64_t iron_e1_uwb = scale(flux.mean, squared, 1000000) + salient_e1_uwb(d);
    identify_know(d, IDENTIFY_FLUX, flux.mean, identify_interval(flux.deviation, gain_e1_uwb, iron_e1_uwb));
    return IDENTIFY_NO_REASON;
}

static void know_inertia(struct identify *d)
{
    const struct identify_ramps *const m = &d->work.ramps;
    int64_t of[PAIRS_MOST], bent_permille = 0;
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
        identify_know(d, IDENTIFY_INERTIA, inertia.mean, interval);
    }
    d->params.inertia_gmm2 = (int32_t)inertia.mean;
}

enum identify_reason identify_think_ramps(struct identify *d)
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
 * A current across the magnets grows until the rotor turns, and pushes it forward, back, forward again; each time until the EMF
 * is 4 % of the bus voltage. That is 7 % of the speed that this bus can reach with this motor, whatever its pole pairs. It
 * gives a first flux and a first inertia for regulating the speed.
 */

#define EMF_PART      25 /* of the bus */
#define EMF_SHIFT     3
#define ARRIVED_PART  16 /* of the rated current */
#define ARRIVE_MS     3u
#define GROW_MS       1000
#define PUSH_MOST_MS  3000u
#define LEAST_TENTHS  2 /* of the rated current */
#define RAMP_TENTHS   4
#define STEEP_TENTHS  7 /* of a reluctant machine, whose ramps are long */
#define TIMES_HALVES  3 /* of what the first motion took */
#define REST_MS       50u
#define INERTIA_LEAST 1

enum push_phase {
    PUSH_GROW,
    PUSH_BACK,
    PUSH_FORTH,
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
    const int32_t i_most_q15 = identify_i_most_q15(d);
    m->i_q15 = measure_ramp(i_most_q15, d->phase_ms, GROW_MS);
    measure_push(io, m->i_q15);
    if (arrived) {
        m->i_q15 = q15_clamp(m->i_q15 * TIMES_HALVES / 2, identify_tenths_q15(d, LEAST_TENTHS), i_most_q15);
        identify_enter(d, PUSH_BACK);
    }
}

/* A run is what lies between half of the largest speed one way and all of it the other. */
static void push(struct identify *d, struct identify_push *m, const struct measure_io *io, int32_t emf_q15,
                 int32_t most_q15)
{
    const int32_t sign = d->phase == PUSH_BACK ? -1 : 1;
    measure_push(io, sign * m->i_q15);
    if (emf_q15 * sign > -most_q15 / 2) {
        measure_run_add(&m->run[d->phase - PUSH_BACK], io, io->loop->v_q_q15);
    }
    if (emf_q15 * sign >= most_q15) {
        identify_enter(d, d->phase + 1u);
    }
}

bool identify_measure_push(struct identify *d, const struct measure_io *io)
{
    struct identify_push *const m = &d->work.push;
    const int32_t emf_q15 = follow_emf(d, m, io), most_q15 = io->loop->vbus_q15 / EMF_PART;
    identify_correct_offset(d, io);
    switch (d->phase) {
    case PUSH_GROW:
        push_grow(d, m, io, emf_q15 >= most_q15);
        break;
    case PUSH_BACK:
    case PUSH_FORTH:
        push(d, m, io, emf_q15, most_q15);
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
    return d->phase_ms > PUSH_MOST_MS;
}

/* ---- evaluation ---- */

/* As fast as the push was allowed to get. */
static int32_t pushed_rpm(const struct identify *d)
{
    /* electrical: nV by 0.1 uWb, 1e-2 */
    const int64_t rad_s_e3 = identify_scaled(d->bus_nv, 10, (int64_t)EMF_PART * d->flux_e1_uwb);
    const int64_t rpm = identify_scaled(rad_s_e3, 60LL * 1000000, TWO_PI_E9 * d->params.pole_pairs);
    return identify_within(rpm, d->params.speed_max_rpm);
}

enum identify_reason identify_think_push(struct identify *d)
{
    const struct identify_push *const m = &d->work.push;
    const struct measure_run *const runs[] = {&m->run[0], &m->run[1]};
    const int64_t flux = d->phase == PUSH_REST ? identify_flux_of_runs(d, runs, 2) : 0;
    const int64_t inertia = flux > 0 ? identify_inertia_gmm2(d, flux, runs[1], runs[0]) : 0;
    if (flux < 100 || inertia < INERTIA_LEAST) {
        return IDENTIFY_NOT_PUSHED;
    }
    d->flux_e1_uwb = (int32_t)flux;
    d->ramp_i_q15 = m->i_q15;
    d->params.flux_uwb = identify_within(scale(flux, 1, 10), 10000000);
    d->params.inertia_gmm2 = identify_within(inertia, 2100000000);
    d->rpm_most = pushed_rpm(d);
    /* as steep as so much of the rated current accelerates */
    const int64_t torque_nnm = identify_torque_nnm(
        d, flux, d->params.i_rated_ma * (1000LL / 10 * (d->reluctant ? STEEP_TENTHS : RAMP_TENTHS)));
    d->params.ramp_rpm_s = identify_within(scale(torque_nnm, 60000, TWO_PI_E9 / 1000000 * inertia), 1000000);
    return identify_tune_turning(d, IDENTIFY_NOT_PUSHED);
}
