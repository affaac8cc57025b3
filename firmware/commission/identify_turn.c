/* SPDX-License-Identifier: MIT */
/*
 * The field turns one electrical turn forward and back, slowly, and the rotor follows: this gives counts per electrical turn
 * and their direction, the ratio of counts per turn to pole pairs. Until the index gives both, the maximum number of pole pairs
 * that fits into the counter is assumed.
 *
 * Only the winding damps the rotor: see damp_q() in identify.c. Friction makes it lag by the same angle in both directions; a
 * load shifts both, and shows in the EMF at higher speed.
 */
#include "drivers/fabric/encoder.h"
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"
#include "lib/q15.h"

#define PULLED_Q32     ((IDENTIFY_ANGLES - 1u) * 0x2AAAAAABu)
#define TURN_MS        900u /* a multiple of thirds */
#define RAMP_MS        200u
#define SOFT_RAMP_MS   500u /* with reluctance the holding torque is lower, and the rotor oscillates more slowly */
#define RISE_MS        300
#define HOLD_MS        450u
#define RELUCTANT_PART 2 /* of the rated current: enough for reluctance to hold the rotor, off the magnets' axis */
#define MIN_COUNTS     4
#define QUARTER_Q32    (1 << 30)
#define APART_ONE_IN   10
#define EVEN_PART      3 /* of a third's travel: allowed difference of another */
#define STEADY_PART    8 /* with a larger difference it is repeated */
#define SLOWER         3 /* so many times more slowly */

/* The assumed machine: maximum of what fits the counter and the format of the maximum speed. */
#define STAND_IN_PAIRS 50

/* Largest speed that check_limits() in tuning.c accepts. */
#define OVERSPEED_E_RPM ((int32_t)(60LL * CONFIG_SPEED_BASE_HZ * 95 / 100))
#define OVERSPEED_MAX   32000

static void begin_pass(const struct identify *d, struct field_pass *p)
{
    const uint32_t times = d->work.turn.slowly ? SLOWER : 1u;
    const int32_t step_q32 = (int32_t)(UINT32_MAX / (TURN_MS * times));
    const uint32_t ramp_ms = d->reluctant ? SOFT_RAMP_MS : RAMP_MS;
    field_pass_start(p, d->phase == 0u ? step_q32 : -step_q32, ramp_ms * times, TURN_MS * times);
}

static void identify_turn_keep_pass(struct identify_turn *m, uint32_t pass)
{
    const struct field_pass *const p = &m->field;
    const int32_t n = (int32_t)p->measure_ms;
    const int32_t sum = p->sum_counts[0] + p->sum_counts[1] + p->sum_counts[2];
    m->travel_counts[pass] = field_pass_counts_q4(p) / 16;
    m->uneven = m->uneven || !field_pass_even(p, EVEN_PART);
    m->unsteady = m->unsteady || !field_pass_even(p, STEADY_PART);
    m->field_q32[pass] = p->reference_q32 + (uint32_t)(p->step_q32 / 2 * (n - 1));
    m->mean_counts_q8[pass] = (p->first_counts + sum / n) * 256 + sum % n * 256 / n;
}

/* A rotor whose oscillation is almost as slow as the field does not follow: repeats more slowly. */
static bool again(struct identify_turn *m)
{
    const bool slower = m->unsteady && !m->slowly;
    m->slowly = m->slowly || slower;
    m->uneven = m->uneven && !slower;
    return slower;
}

/* One phase forward, one back. */
bool identify_measure_turn(struct identify *d, const struct measure_io *io)
{
    struct identify_turn *const m = &d->work.turn;
    if (d->ms == 1u) {
        m->field.field_q32 = PULLED_Q32;
        pendulum_start(&m->rotor, RAMP_MS, 0, PULLED_Q32);
        begin_pass(d, &m->field);
    }
    const int32_t pull_q15 = d->reluctant ? d->i_rated_q15 / RELUCTANT_PART : identify_i_max_q15(d);
    const int32_t i_q15 = measure_ramp(pull_q15, d->ms, RISE_MS);
    if (d->ms < HOLD_MS) {
        pendulum_step(&m->rotor, io->loop, 0, m->field.field_q32, 0, i_q15);
        return false;
    }
    if (!field_pass_step(&m->field, &m->rotor, io->loop, 0, d->counts, i_q15)) {
        return false;
    }
    identify_turn_keep_pass(m, d->phase);
    identify_enter(d, d->phase == 1u && again(m) ? 0u : d->phase + 1u);
    begin_pass(d, &m->field);
    return d->phase == 2u;
}

/* ---- evaluation ---- */

/* The maximum number of pole pairs that fits, with counts of the measured ratio. */
static void stand_in(struct params *p, int32_t counts_two_turns)
{
    const int32_t most = (int32_t)ENCODER_COUNTS_MAX;
    const int32_t pairs = q15_clamp(2 * most / counts_two_turns, 1, STAND_IN_PAIRS);
    p->pole_pairs = pairs;
    p->encoder_counts = q15_min((pairs * counts_two_turns + 1) / 2, most);
    p->overspeed_rpm = q15_min(OVERSPEED_E_RPM / pairs, OVERSPEED_MAX);
    p->speed_max_rpm = p->overspeed_rpm - 1;
}

static uint32_t identify_turn_travel_q32(int64_t counts_q8, int64_t counts_two_turns)
{
    return (uint32_t)identify_scaled(counts_q8, 2LL << 32, counts_two_turns * 256);
}

/* The rotor's angle at the end, from the field's: mean of both directions, whose offsets differ by twice the friction angle. */
static uint32_t angle_by_field_q32(const struct identify *d, int64_t counts_two_turns, int32_t sign)
{
    const struct identify_turn *const m = &d->work.turn;
    uint32_t offset_q32[2];
    for (int32_t k = 0; k < 2; k++) {
        const int64_t to_end_q8 = (int64_t)d->counts * 256 - m->mean_counts_q8[k];
        offset_q32[k] = m->field_q32[k] + identify_turn_travel_q32(sign * to_end_q8, counts_two_turns);
    }
    return offset_q32[0] + (uint32_t)((int32_t)(offset_q32[1] - offset_q32[0]) / 2);
}

/* If reluctance held the rotor, the magnets' angle to the field was below 90 degrees; their axis was measured before. */
static uint32_t angle_by_axis_q32(const struct identify *d, int64_t counts_two_turns, int32_t sign, uint32_t field_q32)
{
    const int64_t moved_q8 = (int64_t)(d->counts - d->axis_counts) * 256;
    const uint32_t axis_q32 = d->axis_q32 + identify_turn_travel_q32(sign * moved_q8, counts_two_turns);
    const int32_t off_q32 = (int32_t)(axis_q32 - field_q32);
    return off_q32 > -QUARTER_Q32 && off_q32 < QUARTER_Q32 ? axis_q32 : axis_q32 + 2u * QUARTER_Q32;
}

enum identify_reason identify_evaluate_turn(struct identify *d)
{
    const struct identify_turn *const m = &d->work.turn;
    const int32_t forward = m->travel_counts[0], back = -m->travel_counts[1];
    const int32_t two_turns = q15_abs(forward + back);
    const bool same = q15_abs(forward - back) * APART_ONE_IN <= two_turns + MIN_COUNTS * APART_ONE_IN;
    if (two_turns < MIN_COUNTS || !same || m->uneven) {
        return IDENTIFY_NOT_FOLLOWED;
    }
    const int32_t sign = forward + back < 0 ? -1 : 1;
    d->backwards = sign < 0;
    identify_set_exact(d, IDENTIFY_DIRECTION, sign);
    d->start_q32 = angle_by_field_q32(d, two_turns, sign);
    if (d->reluctant) {
        d->start_q32 = angle_by_axis_q32(d, two_turns, sign, d->start_q32);
    }
    stand_in(&d->params, two_turns);
    if (d->results[IDENTIFY_RESISTANCE].state != IDENTIFY_KNOWN) {
        d->params.resistance_mohm = q15_max(d->rough_mohm, 1);
    }
    d->params.ld_uh = (int32_t)(d->results[IDENTIFY_LD].value / 1000 + 1);
    d->params.lq_uh = (int32_t)(d->results[IDENTIFY_LQ].value / 1000 + 1);
    return identify_tune_turning(d, IDENTIFY_RATED_SMALL);
}

/* ==== for steps that turn the rotor ==== */

/* Waves, and a frame that follows the rotor. Slow loop. */

#define MIN_PART            64 /* of the bus: below, dead time and noise are too large relative to the EMF */
#define RELUCTANT_AXES_PART 16 /* of the rated current */
#define REST_MS             50u
#define FOLLOW_MS           64    /* the offset's */
#define RADIAN_Q32          20861 /* by Q15: 2^17 / 2 pi */

void identify_play(struct identify *d, const struct measure_io *io, uint32_t field_q32, uint32_t angle_q32)
{
    d->burst.field_q32 = field_q32;
    d->burst.angle_q32 = angle_q32;
    burst_play(&d->burst, io->loop, &io->fabric->adc);
}

/*
 * A frame ahead of the rotor by x sees (sin x, cos x) times the EMF, in either direction. In addition d has -w Lq i_q: where Lq
 * is large and falls with the current, it is known only at a small current.
 */
void identify_correct_offset(const struct identify *d, const struct measure_io *io)
{
    volatile struct current_loop *const c = io->loop;
    const int32_t w_q15 = current_loop_w_q15(c);
    const int32_t cross_q15 = tuning_reactive_q15(w_q15, c->i_q_q15, io->tuning->x_q_q11);
    const int32_t d_q15 = c->v_d_q15 - ((c->i_d_q15 * io->tuning->r_q12) >> 12) + cross_q15;
    const int32_t q_q15 = q15_abs(measure_emf_q15(io));
    const bool large = q15_abs(c->i_q_q15) * RELUCTANT_AXES_PART > d->i_rated_q15;
    if (q15_max(q_q15, q15_abs(d_q15)) * MIN_PART < c->vbus_q15 || (d->reluctant && large)) {
        return;
    }
    /* limited to 1 radian beyond 45 degrees */
    const int32_t tangent_q15 = q15_abs(d_q15) >= q_q15 ? (d_q15 < 0 ? -Q15_ONE : Q15_ONE) : d_q15 * Q15_ONE / q_q15;
    const int32_t ahead_q15 = w_q15 < 0 ? -tangent_q15 : tangent_q15;
    current_loop_offset(c, c->angle_offset_q32 - (uint32_t)(ahead_q15 * RADIAN_Q32 / FOLLOW_MS));
}

bool identify_stop_rotor(const struct identify *d, const struct measure_io *io, uint32_t patience_ms)
{
    return (measure_spin(io, 0, identify_i_max_q15(d)) && d->phase_ms > REST_MS) || d->phase_ms > patience_ms;
}

/* ==== the index ==== */

/*
 * From one index to the next in the same direction the encoder counts a mechanical turn. Divided by the counts per electrical
 * turn this is a whole number, the pole pairs. The speed is that allowed for the push.
 */

#define TURNS_MAX      50 /* maximum number of pole pairs */
#define TIMEOUT_MS     12000u
#define STOP_MS        1500u
#define INDEX_REST_MS  60u
#define REST_PART      16
#define WHOLE_PERCENT  20 /* of a pole pair: allowed distance from a whole number */
#define EDGES_PER_LINE 4

/* Of the maximum speed, with known pole pairs; and that which induces a quarter of the bus voltage. */
#define SPEED_SHARE 4
#define EMF_TIMES   6

/* For measuring inertia: time from rest to the maximum speed. */
#define INDEX_RAMP_MS        150
#define INDEX_RELUCTANT_PART 5 /* of the rated current */
#define SEARCH_QUARTERS      3 /* of the speed of the push, because a reluctance machine overshoots */

enum search_phase {
    SEARCH_RUN,
    SEARCH_STOP,
    SEARCH_REST,
};

/* ---- measuring ---- */

static void read_index(const struct identify *d, struct identify_index *m, const struct measure_io *io)
{
    uint32_t index;
    if (!measure_index(io, &index)) {
        return;
    }
    encoder_clear(&io->fabric->encoder, ENCODER_STATUS_INDEX_SEEN);
    /* it may be later than this millisecond's sample */
    const int32_t at = d->counts - measure_counts(index, io->speed->estimate.count, io->tuning->encoder_counts);
    *(m->seen == 1u ? &m->second : &m->first) = at;
    m->seen++;
}

static bool ran_enough(const struct identify *d, const struct identify_index *m)
{
    const int64_t most = (int64_t)(TURNS_MAX + 1) * (m->seen + 1u) * d->params.encoder_counts;
    return m->seen >= 2u || (int64_t)(d->counts - m->from) * d->params.pole_pairs > most || d->phase_ms > TIMEOUT_MS;
}

/* Runs from index to index; true when done. */
static bool search(const struct identify *d, struct identify_index *m, const struct measure_io *io)
{
    const int32_t rpm = d->reluctant ? q15_max(d->rpm_max / 4 * SEARCH_QUARTERS, 1) : d->rpm_max;
    (void)measure_spin(io, rpm, identify_i_max_q15(d));
    read_index(d, m, io);
    return ran_enough(d, m);
}

static bool stop(const struct identify *d, const struct measure_io *io)
{
    const bool there = measure_spin(io, 0, identify_i_max_q15(d));
    return d->phase_ms > STOP_MS || (there && q15_abs(io->speed->speed_rpm_q4) * REST_PART < d->rpm_max * 16);
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
        return d->phase_ms > INDEX_REST_MS;
    }
    if (d->phase == SEARCH_RUN ? search(d, m, io) : stop(d, io)) {
        identify_enter(d, d->phase + 1u);
    }
    return false;
}

/* ---- evaluation ---- */

/* Replaces the assumed pole pairs: mechanical values scale with their ratio. */
static void take_pole_pairs(struct identify *d, int32_t pole_pairs, int32_t counts)
{
    struct params *const p = &d->params;
    const int64_t before = p->pole_pairs;
    p->inertia_gmm2 = q15_max((int32_t)scale(p->inertia_gmm2, pole_pairs * pole_pairs, before * before), 1);
    p->ramp_rpm_s = q15_max((int32_t)scale(p->ramp_rpm_s, before, pole_pairs), 1);
    const int32_t pushed_rpm = q15_max((int32_t)scale(d->rpm_max, before, pole_pairs), 1);
    d->rpm_max = q15_min(pushed_rpm * EMF_TIMES, q15_max(d->nominal.speed_max_rpm / SPEED_SHARE, 1));
    p->pole_pairs = pole_pairs;
    p->encoder_counts = counts;
    p->overspeed_rpm = d->nominal.overspeed_rpm;
    p->speed_max_rpm = d->nominal.speed_max_rpm;
}

/* Current of the ramps: for ramps of some tenths of a second, and at least that of the push. */
static void choose_ramps(struct identify *d)
{
    const int64_t way_mrad_s = identify_mrad_s(d->rpm_max * 32768LL, 1);
    const int64_t wanted_nnm = scale(way_mrad_s, d->params.inertia_gmm2, INDEX_RAMP_MS);
    const int64_t nnm_per_ma = identify_torque_nnm(d, d->flux_e1_uwb, 1000);
    const int64_t wanted_ma = scale(wanted_nnm, 1, nnm_per_ma < 1 ? 1 : nnm_per_ma);
    const int32_t range_ma = d->params.i_range_ma;
    const int32_t i_q15 = tuning_q15_from_milli((int32_t)(wanted_ma < range_ma ? wanted_ma : range_ma), range_ma);
    /* with strong reluctance q current changes the d flux, which is to be measured at almost zero current */
    d->ramp_i_q15 =
        d->reluctant ? d->i_rated_q15 / INDEX_RELUCTANT_PART : q15_clamp(i_q15, d->ramp_i_q15, identify_i_max_q15(d));
}

static enum identify_reason do_without(struct identify *d)
{
    choose_ramps(d);
    identify_refuse(d, IDENTIFY_POLE_PAIRS, IDENTIFY_COUNTS, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_OFFSET, IDENTIFY_OFFSET, IDENTIFY_NO_INDEX);
    identify_refuse(d, IDENTIFY_INERTIA, IDENTIFY_VISCOUS, IDENTIFY_NO_INDEX);
    return identify_tune_turning(d, IDENTIFY_STOPPED);
}

enum identify_reason identify_evaluate_index(struct identify *d)
{
    const struct identify_index *const m = &d->work.index;
    const int32_t counts = (m->second - m->first + EDGES_PER_LINE / 2) / EDGES_PER_LINE * EDGES_PER_LINE;
    const int32_t percent =
        (int32_t)scale(counts < 0 ? 0 : counts, 100LL * d->params.pole_pairs, d->params.encoder_counts);
    const int32_t pole_pairs = (percent + 50) / 100;
    if (m->seen < 2u || pole_pairs < 1 || pole_pairs > TURNS_MAX ||
        q15_abs(percent - 100 * pole_pairs) > WHOLE_PERCENT || counts < 64 || counts > (int32_t)ENCODER_COUNTS_MAX) {
        return do_without(d);
    }
    identify_set_exact(d, IDENTIFY_POLE_PAIRS, pole_pairs);
    identify_set_exact(d, IDENTIFY_COUNTS, counts);
    take_pole_pairs(d, pole_pairs, counts);
    choose_ramps(d);
    d->indexed = true;
    return identify_tune_turning(d, IDENTIFY_LOADED);
}
