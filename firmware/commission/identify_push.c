/* SPDX-License-Identifier: MIT */
/*
 * A current across the magnets grows until the rotor turns, and pushes it forward, back, forward again; each time until the EMF
 * is 4 % of the bus voltage. That is 7 % of the speed that this bus can reach with this motor, whatever its pole pairs. It
 * gives a first flux and a first inertia for regulating the speed.
 */
#include "firmware/commission/identify_parts.h"

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
    return d->phase_ms > PATIENCE_MS;
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
