/* SPDX-License-Identifier: MIT */
/*
 * From one index to the next in the same direction the encoder counts a mechanical turn. The ratio from the field's turn
 * converts that to electrical turns, a whole number: the pole pairs. The speed is the one allowed for the push.
 */
#include "drivers/fabric/encoder.h"
#include "firmware/commission/identify_parts.h"

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

/* ---- measuring ---- */

static void index_look(const struct identify *d, struct identify_index *m, const struct measure_io *io)
{
    uint32_t index;
    if (!measure_index(io, &index)) {
        return;
    }
    encoder_clear(&io->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
    /* it may have come after this millisecond's sample */
    const int32_t at = d->counts - measure_counts(index, io->speed->estimate.count, io->tuning->encoder_counts);
    *(m->seen == 1u ? &m->second : &m->first) = at;
    m->seen++;
}

static bool ran_enough(const struct identify *d, const struct identify_index *m)
{
    const int64_t most = (int64_t)(TURNS_MOST + 1) * (m->seen + 1u) * d->params.encoder_counts;
    return m->seen >= 2u || (int64_t)(d->counts - m->from) * d->params.pole_pairs > most || d->phase_ms > PATIENCE_MS;
}

/* Runs from index to index; true when it has seen what there is. */
static bool search(const struct identify *d, struct identify_index *m, const struct measure_io *io)
{
    const int32_t rpm = d->reluctant ? q15_max(d->rpm_most / 4 * SEARCH_QUARTERS, 1) : d->rpm_most;
    (void)measure_spin(io, rpm, identify_i_most_q15(d));
    index_look(d, m, io);
    return ran_enough(d, m);
}

static bool stop(const struct identify *d, const struct measure_io *io)
{
    const bool there = measure_spin(io, 0, identify_i_most_q15(d));
    return d->phase_ms > STOP_MS || (there && q15_abs(io->speed->speed_rpm_q4) * REST_PART < d->rpm_most * 16);
}

bool identify_measure_index(struct identify *d, const struct measure_io *io)
{
    struct identify_index *const m = &d->work.index;
    if (d->ms == 1u) {
        m->from = d->counts;
        encoder_clear(&io->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
    }
    identify_correct_offset(d, io);
    if (d->phase == SEARCH_REST) {
        measure_push(io, 0);
        return d->phase_ms > REST_MS;
    }
    if (d->phase == SEARCH_RUN ? search(d, m, io) : stop(d, io)) {
        identify_enter(d, d->phase + 1u);
    }
    return false;
}

/* ---- evaluation ---- */

/* From the machine that stood in to the motor: what is mechanical changes with the ratio of the turns. */
static void take_pole_pairs(struct identify *d, int32_t pole_pairs, int32_t counts)
{
    struct params *const p = &d->params;
    const int64_t before = p->pole_pairs;
    p->inertia_gmm2 = q15_max((int32_t)scale(p->inertia_gmm2, pole_pairs * pole_pairs, before * before), 1);
    p->ramp_rpm_s = q15_max((int32_t)scale(p->ramp_rpm_s, before, pole_pairs), 1);
    const int32_t pushed_rpm = q15_max((int32_t)scale(d->rpm_most, before, pole_pairs), 1);
    d->rpm_most = q15_min(pushed_rpm * EMF_TIMES, q15_max(d->nominal.speed_max_rpm / SPEED_SHARE, 1));
    p->pole_pairs = pole_pairs;
    p->encoder_counts = counts;
    p->overspeed_rpm = d->nominal.overspeed_rpm;
    p->speed_max_rpm = d->nominal.speed_max_rpm;
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
    d->ramp_i_q15 =
        d->reluctant ? d->i_rated_q15 / RELUCTANT_PART : q15_clamp(i_q15, d->ramp_i_q15, identify_i_most_q15(d));
}

static enum identify_reason do_without(struct identify *d)
{
    choose_ramps(d);
    identify_refuse(d, IDENTIFY_POLE_PAIRS, IDENTIFY_COUNTS, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_OFFSET, IDENTIFY_OFFSET, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_INERTIA, IDENTIFY_VISCOUS, IDENTIFY_NO_INDEX);
    return identify_tune_turning(d, IDENTIFY_STOPPED);
}

enum identify_reason identify_think_index(struct identify *d)
{
    const struct identify_index *const m = &d->work.index;
    const int32_t counts = (m->second - m->first + EDGES_PER_LINE / 2) / EDGES_PER_LINE * EDGES_PER_LINE;
    const int32_t percent =
        (int32_t)scale(counts < 0 ? 0 : counts, 100LL * d->params.pole_pairs, d->params.encoder_counts);
    const int32_t pole_pairs = (percent + 50) / 100;
    if (m->seen < 2u || pole_pairs < 1 || pole_pairs > TURNS_MOST ||
        q15_abs(percent - 100 * pole_pairs) > WHOLE_PERCENT || counts < 64 || counts > (int32_t)ENCODER_COUNTS_MAX) {
        return do_without(d);
    }
    identify_know_exactly(d, IDENTIFY_POLE_PAIRS, pole_pairs);
    identify_know_exactly(d, IDENTIFY_COUNTS, counts);
    take_pole_pairs(d, pole_pairs, counts);
    choose_ramps(d);
    d->indexed = true;
    return identify_tune_turning(d, IDENTIFY_LOADED);
}
