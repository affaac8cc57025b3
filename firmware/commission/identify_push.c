/* SPDX-License-Identifier: MIT */
/*
 * A current across the magnets grows until the rotor turns, and pushes it forth, back and forth again; each time until the EMF
 * is 4 % of the bus voltage. That is 7 % of the speed that this bus can reach with this motor, whatever its pole pairs. It
 * gives a first flux and a first inertia for regulating the speed.
 */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/scale.h"
#include "lib/q15.h"

#define EMF_PART      25 /* of the bus */
#define EMF_SHIFT     3
#define ARRIVED_PART  16 /* of the rated current */
#define ARRIVE_MS     3u
#define GROW_MS       1000
#define PATIENCE_MS   3000u
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

static void enter(struct identify_push *m, enum push_phase phase)
{
    m->phase = phase;
    m->phase_ms = 0;
}

static bool stopped(const struct identify_io *io)
{
    return io->speed->estimate.speed_rpm_q15 <= 0;
}

/* While the current changes, the inductive voltage exceeds the EMF. */
static void follow_emf(const struct identify *d, struct identify_push *m, const struct identify_io *io)
{
    const int32_t away_q15 = q15_abs(io->loop->i_q_ref_q15 - io->loop->i_q_q15);
    if (away_q15 * ARRIVED_PART <= d->i_rated_q15 && m->phase_ms > ARRIVE_MS) {
        m->emf_q18 += identify_emf_q15(io) - (m->emf_q18 >> EMF_SHIFT);
    }
}

/* A run is what lies between half of the largest speed one way and all of it the other. */
static void push(struct identify_push *m, const struct identify_io *io, int32_t sign, int32_t emf_q15, int32_t most_q15)
{
    identify_push(io, sign * m->i_q15);
    if (emf_q15 * sign > -most_q15 / 2) {
        identify_run_add(&m->run[m->phase == PUSH_BACK ? 0 : 1], io);
    }
    if (emf_q15 * sign >= most_q15) {
        enter(m, m->phase + 1u);
    }
}

static void grow(const struct identify *d, struct identify_push *m, const struct identify_io *io, int32_t emf_q15,
                 int32_t most_q15)
{
    const int32_t i_most_q15 = identify_i_most_q15(d);
    m->i_q15 = i_most_q15 * q15_min((int32_t)m->phase_ms, GROW_MS) / GROW_MS;
    identify_push(io, m->i_q15);
    if (emf_q15 >= most_q15) {
        const int32_t least_q15 = d->i_rated_q15 * LEAST_TENTHS / 10;
        m->i_q15 = q15_clamp(m->i_q15 * TIMES_HALVES / 2, least_q15, i_most_q15);
        enter(m, PUSH_BACK);
    }
}

bool identify_measure_push(struct identify *d, const struct identify_io *io)
{
    struct identify_push *const m = &d->push;
    if (d->ms == 1u) {
        *m = (struct identify_push){.phase = PUSH_GROW};
    }
    m->phase_ms++;
    follow_emf(d, m, io);
    const int32_t emf_q15 = m->emf_q18 >> EMF_SHIFT;
    const int32_t most_q15 = io->loop->vbus_q15 / EMF_PART;
    identify_correct_offset(d, io);
    switch (m->phase) {
    case PUSH_GROW:
        grow(d, m, io, emf_q15, most_q15);
        break;
    case PUSH_BACK:
        push(m, io, -1, emf_q15, most_q15);
        break;
    case PUSH_FORTH:
        push(m, io, 1, emf_q15, most_q15);
        break;
    case PUSH_STOP:
        identify_push(io, -m->i_q15);
        if (stopped(io)) {
            enter(m, PUSH_REST);
        }
        break;
    case PUSH_REST:
    default:
        identify_push(io, 0);
        return m->phase_ms > REST_MS;
    }
    return m->phase_ms > PATIENCE_MS;
}

/* ---- evaluation ---- */

/* As fast as the push was allowed to get. */
static int32_t pushed_rpm(const struct identify *d)
{
    const int64_t bus_nv = identify_nv(d, d->pulses.sums[0].vbus_q15, d->pulses.sums[0].bursts);
    const int64_t rad_s_e3 =
        identify_scaled(bus_nv, 10, (int64_t)EMF_PART * d->flux_e1_uwb); /* electrical: nV by 0.1 uWb, 1e-2 */
    const int64_t rpm = identify_scaled(rad_s_e3, 60LL * 1000000, TWO_PI_E9 * d->params.pole_pairs);
    const int64_t most = d->params.speed_max_rpm;
    return (int32_t)(rpm < 1 ? 1 : rpm < most ? rpm : most);
}

static int32_t within(int64_t value, int64_t most)
{
    return (int32_t)(value < 1 ? 1 : value < most ? value : most);
}

bool identify_think_push(struct identify *d)
{
    const struct identify_push *const m = &d->push;
    const struct identify_run *const runs[] = {&m->run[0], &m->run[1]};
    const int64_t flux = m->phase == PUSH_REST ? identify_flux_of_runs(d, runs, 2) : 0;
    const int64_t inertia = flux > 0 ? identify_inertia_gmm2(d, flux, runs[1], runs[0]) : 0;
    if (flux < 100 || inertia < INERTIA_LEAST) {
        identify_refuse_rest(d, IDENTIFY_POLE_PAIRS, IDENTIFY_NOT_PUSHED);
        return false;
    }
    d->flux_e1_uwb = (int32_t)flux;
    d->params.flux_uwb = within(scale(flux, 1, 10), 10000000);
    d->params.inertia_gmm2 = within(inertia, 2100000000);
    d->rpm_most = pushed_rpm(d);
    /* as steep as so much of the rated current accelerates */
    const int64_t torque_nnm = identify_torque_nnm(
        d, flux, d->params.i_rated_ma * (1000LL / 10 * (d->reluctant ? STEEP_TENTHS : RAMP_TENTHS)));
    d->params.ramp_rpm_s = within(scale(torque_nnm, 60000, TWO_PI_E9 / 1000000 * inertia), 1000000);
    if (!identify_tune_turning(d)) {
        identify_refuse_rest(d, IDENTIFY_POLE_PAIRS, IDENTIFY_NOT_PUSHED);
        return false;
    }
    return true;
}
