/* SPDX-License-Identifier: MIT */
/*
 * From one index to the next in the same direction the encoder counts a mechanical turn. The ratio from the field's turn
 * converts that to electrical turns, a whole number: the pole pairs. The speed is the one allowed for the push.
 */
#include "drivers/fabric/encoder.h"
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/scale.h"
#include "lib/q15.h"

#define TURNS_MOST     50 /* electrical ones to a mechanical: as many pole pairs as there can be */
#define PATIENCE_MS    12000u
#define STOP_MS        1500u
#define REST_MS        60u
#define REST_PART      16
#define WHOLE_PERCENT  20 /* of a pole pair: further from a whole number nothing is known */
#define EDGES_PER_LINE 4

/* Of the largest speed, while pole pairs are known; and that which induces a quarter of the bus voltage. */
#define SPEED_SHARE 4
#define EMF_TIMES   6

/* By which inertia is measured: so long from rest to the largest speed. */
#define RAMP_MS         150
#define RELUCTANT_PART  5 /* of the rated current */
#define SEARCH_QUARTERS 3 /* of the speed of the push, by whose inertia a reluctant machine's overshoots */

enum search_phase {
    SEARCH_RUN,
    SEARCH_STOP,
    SEARCH_REST,
};

static int32_t search_rpm(const struct identify *d)
{
    return d->reluctant ? q15_max(d->rpm_most / 4 * SEARCH_QUARTERS, 1) : d->rpm_most;
}

static void look(struct identify *d, struct identify_index_search *m, const struct identify_io *io)
{
    struct encoder_regs *const encoder = &io->fabric->encoder;
    if ((encoder_status(encoder) & ENCODER_STATUS_INDEX_SEEN) == 0u) {
        return;
    }
    const uint32_t index = encoder_index(encoder);
    encoder_clear(encoder, ENCODER_STATUS_INDEX_SEEN);
    /* the shorter way round: it may have come after this millisecond's sample */
    const int32_t turn = io->tuning->encoder_counts;
    int32_t since = (int32_t)io->speed->estimate.count - (int32_t)index;
    since += since < -turn / 2 ? turn : since > turn / 2 ? -turn : 0;
    const int32_t at = d->counts - since;
    if (m->seen == 1u) {
        m->second = at;
    } else {
        m->first = at;
    }
    m->seen++;
}

static bool ran_enough(const struct identify *d, const struct identify_index_search *m)
{
    const int64_t most = (int64_t)(TURNS_MOST + 1) * (m->seen + 1u) * d->params.encoder_counts;
    return m->seen >= 2u || (int64_t)(d->counts - m->from) * d->params.pole_pairs > most || m->phase_ms > PATIENCE_MS;
}

static void enter(struct identify_index_search *m, enum search_phase phase)
{
    m->phase = phase;
    m->phase_ms = 0;
}

bool identify_measure_index(struct identify *d, const struct identify_io *io)
{
    struct identify_index_search *const m = &d->index;
    if (d->ms == 1u) {
        *m = (struct identify_index_search){.phase = SEARCH_RUN, .from = d->counts};
        encoder_clear(&io->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
        speed_loop_reset(io->speed, 0);
    }
    m->phase_ms++;
    identify_correct_offset(d, io);
    if (m->phase == SEARCH_RUN) {
        identify_control_speed(io, search_rpm(d), identify_i_most_q15(d));
        look(d, m, io);
        if (ran_enough(d, m)) {
            enter(m, SEARCH_STOP);
        }
        return false;
    }
    if (m->phase == SEARCH_STOP) {
        identify_control_speed(io, 0, identify_i_most_q15(d));
        const int32_t slow_q4 = d->rpm_most;
        if (m->phase_ms > STOP_MS ||
            (io->speed->ref_rpm_q16 == 0 && q15_abs(io->speed->speed_rpm_q4) * REST_PART < slow_q4 * 16)) {
            enter(m, SEARCH_REST);
        }
        return false;
    }
    identify_push(io, 0);
    return m->phase_ms > REST_MS;
}

/* ---- evaluation ---- */

/* Speeds from here on: the motor's pole pairs are known, and so is the mechanic's speed. */
static void set_speed(struct identify *d)
{
    const int32_t by_told = q15_max(d->told.speed_max_rpm / SPEED_SHARE, 1);
    d->rpm_most = q15_min(d->rpm_most * EMF_TIMES, by_told);
}

/* From the machine that stood in to the motor: what is mechanical changes with the ratio of the turns. */
static void take_pole_pairs(struct identify *d, int32_t pole_pairs, int32_t counts)
{
    struct params *const p = &d->params;
    const int64_t before = p->pole_pairs;
    p->inertia_gmm2 = (int32_t)q15_max((int32_t)scale(p->inertia_gmm2, pole_pairs * pole_pairs, before * before), 1);
    p->ramp_rpm_s = (int32_t)q15_max((int32_t)scale(p->ramp_rpm_s, before, pole_pairs), 1);
    d->rpm_most = (int32_t)q15_max((int32_t)scale(d->rpm_most, before, pole_pairs), 1);
    p->pole_pairs = pole_pairs;
    p->encoder_counts = counts;
    p->overspeed_rpm = d->told.overspeed_rpm;
    p->speed_max_rpm = d->told.speed_max_rpm;
}

/* The ramps' current: so that they take some tenths of a second, and what the push took at least. */
static void choose_ramps(struct identify *d)
{
    const int64_t way_mrad_s = identify_mrad_s(d->rpm_most * 32768LL, 1);
    const int64_t wanted_nnm = scale(way_mrad_s, d->params.inertia_gmm2, RAMP_MS);
    const int64_t nnm_per_ma = identify_torque_nnm(d, d->flux_e1_uwb, 1000);
    const int64_t wanted_ma = scale(wanted_nnm, 1, nnm_per_ma < 1 ? 1 : nnm_per_ma);
    const int32_t range_ma = d->params.i_range_ma;
    const int32_t i_q15 = tuning_q15_from_milli((int32_t)(wanted_ma < range_ma ? wanted_ma : range_ma), range_ma);
    /* where reluctance is strong the current across changes the flux along, which shall be known next to no current */
    const int32_t least_q15 = d->reluctant ? d->i_rated_q15 / RELUCTANT_PART : d->push.i_q15;
    d->ramp_i_q15 = d->reluctant ? least_q15 : q15_clamp(i_q15, least_q15, identify_i_most_q15(d));
}

static bool refuse(struct identify *d)
{
    choose_ramps(d);
    identify_refuse(d, IDENTIFY_POLE_PAIRS, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_COUNTS, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_OFFSET, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_INERTIA, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_COULOMB, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_VISCOUS, IDENTIFY_NO_INDEX);
    return identify_tune_turning(d);
}

bool identify_think_index(struct identify *d)
{
    const struct identify_index_search *const m = &d->index;
    const int32_t between = m->second - m->first;
    const int32_t counts = (between + EDGES_PER_LINE / 2) / EDGES_PER_LINE * EDGES_PER_LINE;
    const int32_t percent =
        (int32_t)scale(counts < 0 ? 0 : counts, 100LL * d->params.pole_pairs, d->params.encoder_counts);
    const int32_t pole_pairs = (percent + 50) / 100;
    const int32_t off = percent - 100 * pole_pairs;
    if (m->seen < 2u || pole_pairs < 1 || pole_pairs > TURNS_MOST || off > WHOLE_PERCENT || off < -WHOLE_PERCENT ||
        counts < 64 || counts > (int32_t)ENCODER_COUNTS_MAX) {
        return refuse(d);
    }
    identify_know_exactly(d, IDENTIFY_POLE_PAIRS, pole_pairs);
    identify_know_exactly(d, IDENTIFY_COUNTS, counts);
    take_pole_pairs(d, pole_pairs, counts);
    set_speed(d);
    choose_ramps(d);
    d->indexed = true;
    if (!identify_tune_turning(d)) {
        identify_refuse_rest(d, IDENTIFY_OFFSET, IDENTIFY_LOADED);
        return false;
    }
    return true;
}
