/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/encoder_watch.h"

#include "firmware/axis/axis.h"
#include "firmware/settings/config.h"
#include "lib/advance.h"
#include "lib/angle.h"
#include "lib/q15.h"

/* ==== lost counts, by the EMF ==== */

#define MEAN_SHIFT  3 /* steps averaged, by the EMF's filter: 16, up to 128 */
#define MIN_SHIFT   5 /* a 32nd of the bus: less EMF is not evaluated */
#define DEAD_SHIFT  8 /* of the bus: variation of the dead-time error */
#define SAME_SHIFT  2 /* operating point unchanged: current within a quarter, speed within an eighth */
#define NOISE_SHIFT 5 /* and a 32nd of i_max */
#define ELSEWHERE   8 /* steps: a lost count disturbs speed and currents for less */
#define STEPS       3
#define MAX_Q15     131071

struct slip_view {
    int32_t i_d_q15, i_q_q15, w_q15;
    int32_t i_d_ref_q15, i_q_ref_q15;
    int32_t v_d_q15; /* in the rotor's frame at the sample */
};

static struct slip_view point_now(const volatile struct current_loop *c)
{
    int32_t v_d_q15 = c->v_d_q15;
    int32_t v_q_q15 = c->v_q_q15;
    advance_q15(&v_d_q15, &v_q_q15, -c->v_turn_q15);
    return (struct slip_view){.i_d_q15 = c->i_d_q15,
                              .i_q_q15 = c->i_q_q15,
                              .w_q15 = current_loop_w_q15(c),
                              .i_d_ref_q15 = c->i_d_ref_q15,
                              .i_q_ref_q15 = c->i_q_ref_q15,
                              .v_d_q15 = v_d_q15};
}

static bool is_same(int32_t now, int32_t then, int32_t shift, int32_t noise)
{
    return q15_abs(now - then) <= (q15_abs(then) >> shift) + noise;
}

static bool at_same_point(const struct slip_watch *s, const struct slip_view *v, const struct tuning *t)
{
    const int32_t noise_q15 = t->i_max_q15 >> NOISE_SHIFT;
    return is_same(v->w_q15, s->w_q15, SAME_SHIFT + 1, 0) &&
           is_same(v->i_d_ref_q15, s->i_d_q15, SAME_SHIFT, noise_q15) &&
           is_same(v->i_q_ref_q15, s->i_q_q15, SAME_SHIFT, noise_q15);
}

/* A lost count turns the frame, too: the currents deviate from their references for some milliseconds. */
static bool is_kicked(const struct slip_view *v, const struct tuning *t)
{
    const int32_t noise_q15 = t->i_max_q15 >> NOISE_SHIFT;
    return !is_same(v->i_q_q15, v->i_q_ref_q15, SAME_SHIFT, noise_q15);
}

/* w Lq i_q at the stored Lq. */
static int32_t reaction_q15(const struct slip_watch *s, int32_t w_q15, int32_t i_q_q15)
{
    const int64_t reaction = ((int64_t)((w_q15 * i_q_q15) >> 15) * (s->lq_q19 >> 8)) >> 11;
    return reaction > MAX_Q15 ? MAX_Q15 : (reaction < -MAX_Q15 ? -MAX_Q15 : (int32_t)reaction);
}

static int32_t across_q15(const struct slip_watch *s, const struct slip_view *v, const struct tuning *t)
{
    return v->v_d_q15 - ((t->r_q12 * v->i_d_q15) >> 12) + reaction_q15(s, v->w_q15, v->i_q_q15);
}

/* 11 degrees of the EMF, plus uncertainty of a change: half of the reaction's, half of the resistance. */
static int32_t allowed_q15(const struct slip_watch *s, const struct slip_view *v, const struct emf *e,
                           const struct tuning *t, int32_t vbus_q15)
{
    const int32_t length_q15 = q15_max(q15_abs(e->filtered.q_q15), e->expected_q15 / 2);
    const int32_t reaction = q15_abs(reaction_q15(s, v->w_q15, v->i_q_q15) - reaction_q15(s, s->w_q15, s->i_q_q15));
    const int32_t i_d_q15 = q15_abs(v->i_d_q15 - s->i_d_q15) + q15_abs(v->i_d_q15) / 2;
    return (int32_t)(((int64_t)length_q15 * e->turned_q15) >> 17) * 3 + reaction / 2 + ((t->r_q12 * i_d_q15) >> 12) +
           (vbus_q15 >> DEAD_SHIFT) + e->moving_q15;
}

static void begin_at(struct slip_watch *s, const struct slip_view *v, const struct emf *e, const struct tuning *t)
{
    *s = (struct slip_watch){
        .i_d_q15 = v->i_d_ref_q15, .i_q_q15 = v->i_q_ref_q15, .w_q15 = v->w_q15, .lq_q19 = e->lq_q19, .steps = 1};
    s->across_q15 = across_q15(s, v, t);
}

/*
 * One step with the present voltages; `e` is the filtered EMF. True if the change has exceeded about 11 degrees, plus what a
 * change of speed and current may explain, for three steps.
 */
static bool slip_watch_step(struct slip_watch *s, const struct emf *e, const volatile struct current_loop *c,
                            const struct tuning *t)
{
    const struct slip_view v = point_now(c);
    const int32_t steps_shift = MEAN_SHIFT + (int32_t)e->filter_shift;
    if (e->expected_q15 <= c->vbus_q15 >> MIN_SHIFT) {
        s->steps = 0;
        return false;
    }
    const bool same = at_same_point(s, &v, t) && !is_kicked(&v, t);
    s->elsewhere = same ? 0 : s->elsewhere + 1;
    if (s->steps == 0 || s->elsewhere >= ELSEWHERE) {
        begin_at(s, &v, e, t);
        return false;
    }
    if (!same) {
        return false;
    }
    const int32_t now_q15 = across_q15(s, &v, t);
    if (s->steps < 1 << steps_shift) {
        s->across_q15 += now_q15;
        s->steps++;
        s->across_q15 >>= s->steps == 1 << steps_shift ? steps_shift : 0;
        return false;
    }
    s->changed_q15 += (now_q15 - s->across_q15 - s->changed_q15) >> e->filter_shift;
    const bool against = q15_abs(s->changed_q15) > allowed_q15(s, &v, e, t, c->vbus_q15);
    s->against = against ? s->against + 1 : q15_max(s->against - 1, 0);
    return s->against >= STEPS;
}

/* ==== the encoder ==== */

/* ==== the rotor's angle after a fault ==== */

/* The rotor's angle when the encoder has failed, from what is still valid. */

/* The frame is that of the next sample. */
static void by_frame(const struct axis *a, struct rotor_seed *seed)
{
    seed->speed_q32 = a->loop.pll.speed_q32;
    seed->angle_q32 = current_loop_angle_q32(&a->loop) - (uint32_t)seed->speed_q32;
    seed->clock = encoder_latch_clock(&a->fabric->encoder);
}

/* Counts were lost gradually: by the index, else by the EMF of the last four milliseconds, in the frame of the last sample. */
static void by_slip(const struct axis *a, struct rotor_seed *seed)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    by_frame(a, seed);
    if (e->index_slip) {
        seed->angle_q32 -= (uint32_t)e->index_drift * a->loop.encoder_scale_q32;
        return;
    }
    seed->angle_q32 += emf_angle_q32(&e->emf.filtered, seed->speed_q32 < 0);
}

/* The index gives the count error, unless the index itself is wrong and the EMF agrees with the frame. */
static void by_index(const struct axis *a, struct rotor_seed *seed)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    by_frame(a, seed);
    const bool agrees = emf_is_clear(&e->emf) && emf_judge(&e->emf, seed->speed_q32 < 0) == EMF_AGREES;
    if (!agrees || a->tuning.reluctant) { /* where the index check is ambiguous by half a turn */
        seed->angle_q32 -= (uint32_t)e->index_drift * a->loop.encoder_scale_q32;
    }
}

/*
 * Counts have stopped: the last edge is half a count from the middle of the present count; the speed is from before the stopped
 * counts can have affected it.
 */
static void by_last_edge(const struct axis *a, struct rotor_seed *seed)
{
    const struct encoder_regs *const encoder = &a->fabric->encoder;
    const int32_t speed_q32 = a->supervision.encoder.speed_moving_q32;
    const int32_t half_q32 = (int32_t)(a->loop.encoder_scale_q32 / 2u);
    *seed = encoder_watch_seed_of(a, encoder_latched(encoder), speed_q32 < 0 ? -half_q32 : half_q32,
                                  encoder_edge_clock(encoder));
    seed->speed_q32 = speed_q32;
}

void encoder_watch_seed_at_sample(const struct axis *a, enum fault cause, struct rotor_seed *seed)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    const struct encoder_regs *const encoder = &a->fabric->encoder;
    const int32_t surprise_q32 = encoder_watch_deviation_q32(a);
    if (cause == FAULT_ENCODER_DEAD) {
        by_last_edge(a, seed);
    } else if (e->suspect_ms != 0u) {
        *seed = e->sound;
    } else if (angle_size_q32(surprise_q32) > e->jump_limit_q32) {
        *seed = encoder_watch_seed_of(a, encoder_latched(encoder), surprise_q32, encoder_latch_clock(encoder));
        seed->speed_q32 = e->speed_q32;
    } else {
        by_frame(a, seed);
    }
}

void encoder_watch_seed(const struct axis *a, enum fault cause, struct rotor_seed *seed)
{
    if (cause == FAULT_ENCODER_DEAD) {
        by_last_edge(a, seed);
    } else if (a->supervision.encoder.suspect_ms != 0u) {
        *seed = a->supervision.encoder.sound;
    } else if (cause == FAULT_ENCODER_SLIP) {
        by_slip(a, seed);
    } else {
        by_index(a, seed);
    }
}

int32_t encoder_watch_torque_q29(const struct axis *a)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    return e->suspect_ms != 0u ? e->torque_q29 : a->speed.integral_q29;
}

void encoder_watch_forget(struct axis *a)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    a->speed.integral_q29 = encoder_watch_torque_q29(a);
    e->suspect_ms = 0;
    e->still_ms = 0;
    e->against_ms = 0;
}

#define JUMP_DEG       20u
#define JUMP_COUNTS    3u                /* of a coarse encoder: less is edge jitter */
#define DEGREES(n)     (11930464u * (n)) /* Q32 */
#define JUMP_MAX       45u               /* degrees: limit of the usual deviation, well below 90 */
#define JUMP_SHIFT     4                 /* the usual deviation decays by 1/16 a millisecond */
#define SUSPECT_MS     8u
#define SUSPECT_BAD_MS 2u   /* the EMF must contradict for this long */
#define TURNED_TIMES   3u   /* contradictions needed without a jump: slow loss of counts */
#define AGREED_OFTEN   8u   /* from then on the offset counts as verified */
#define STILL_MS       4u   /* without a count: the encoder may be dead */
#define STILL_TURN     150u /* electrical degrees in which the EMF of a turning rotor is across the current for 90 */
#define ACROSS_SHIFT   6    /* a 64th of the bus: dead-time error across the current */
#define STILL_COUNTS   8u
#define INDEX_COUNTS   2  /* from pulse to pulse */
#define EMF_TURN       1u /* the EMF is computed, */
#define JUDGE_TURN     3u /* and judged; in the others compared with its earlier value */
#define INDEX_DRIFT    4  /* from the first pulse, in the same direction */

static int32_t w_of(const struct axis *a, int32_t speed_q32)
{
    return q15_sat16(speed_q32 >> a->loop.w_shift);
}

/*
 * A shaft that maximum current can stop within 4 ms, or that turns below a twentieth of the maximum speed, can stop within a
 * millisecond.
 */
static int32_t dead_w_q15(const struct axis *a)
{
    const struct tuning *const t = &a->tuning;
    const uint32_t slope_q16 = (uint32_t)t->i_max_q15 * 65536u / (uint32_t)q15_max(t->speed_accel_q8, 1) * 256u;
    const int32_t by_torque_rpm = (int32_t)(slope_q16 >> 16) * 4;
    const int32_t rpm = q15_max(by_torque_rpm, a->params.speed_max_rpm / 20);
    const int64_t w = (int64_t)rpm * t->overspeed_w_q15 / a->params.overspeed_rpm;
    return w > INT16_MAX ? INT16_MAX : (int32_t)w;
}

void encoder_watch_begin(struct axis *a)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    const uint32_t coarse_q32 = JUMP_COUNTS * a->tuning.encoder_scale_q32;
    *e = (struct encoder_watch){.speed_q32 = a->loop.pll.speed_q32,
                                .speed_before_q32 = a->loop.pll.speed_q32,
                                .dead_w_q15 = dead_w_q15(a),
                                .still_limit_q15 = STILL_COUNTS * (a->tuning.encoder_scale_q32 >> CONFIG_W_SHIFT) /
                                                   CONFIG_PERIODS_PER_SLOW,
                                .index = encoder_index(&a->fabric->encoder)};
    e->jump_min_q32 = coarse_q32 > DEGREES(JUMP_DEG) ? coarse_q32 : DEGREES(JUMP_DEG);
    e->jump_limit_q32 = e->jump_min_q32;
    emf_reset(&e->emf, &a->tuning);
    emf_set_count(&e->emf, a->tuning.encoder_scale_q32);
}

/* Deviation, electrical, of the motion by these counts in these clocks from what the speed predicts. */
static int32_t deviation_q32_of(const struct tuning *t, int32_t moved, uint32_t clocks, int32_t speed_q32)
{
    const uint32_t loop_counts = (uint32_t)t->loop_counts;
    const uint32_t samples = (clocks + loop_counts / 2u) / loop_counts;
    return (int32_t)((uint32_t)moved * t->encoder_scale_q32 - samples * (uint32_t)speed_q32);
}

/* Counts from `before` to `now`, in the shorter direction. */
static int32_t counts_between(const struct axis *a, uint32_t before, uint32_t now)
{
    const int32_t turn = a->params.encoder_counts;
    const int32_t between = (int32_t)(now - before);
    if (between > turn / 2) {
        return between - turn;
    }
    return between < -turn / 2 ? between + turn : between;
}

static int32_t degrees(int32_t angle_q32)
{
    return ((angle_q32 >> 16) * 360) >> 16;
}

struct rotor_seed encoder_watch_seed_of(const struct axis *a, uint32_t count, int32_t jump_q32, uint32_t clock)
{
    const uint32_t angle_q32 = count * a->loop.encoder_scale_q32 + a->loop.angle_offset_q32;
    return (struct rotor_seed){.angle_q32 = angle_q32 - (uint32_t)jump_q32, .clock = clock};
}

static void begin_suspicion(const struct axis *a, struct encoder_watch *e, int32_t jump_q32)
{
    e->suspect_ms = SUSPECT_MS;
    e->jump_q32 = jump_q32;
    e->w_before_q15 = w_of(a, e->speed_before_q32);
    e->emf_before = e->emf.filtered;
    e->against_ms = 0;
    e->torque_q29 = speed_loop_before_q29(&a->speed, a->torque.torque_q15 <= 0);
    e->sound = encoder_watch_seed_of(a, a->speed.estimate.count, jump_q32, a->speed.estimate.latch_clock);
    e->sound.speed_q32 = e->speed_before_q32;
}

/* No edge for the time of eight counts, by the edges' time stamps. */
static bool counts_have_stopped(const struct axis *a, int32_t speed_q32)
{
    const struct encoder_regs *const encoder = &a->fabric->encoder;
    const uint32_t quiet = encoder_latch_clock(encoder) - encoder_edge_clock(encoder);
    const uint32_t samples = quiet / (uint32_t)a->tuning.loop_counts;
    return samples >= 2u &&
           (uint64_t)samples * angle_size_q32(speed_q32) > STILL_COUNTS * (uint64_t)a->tuning.encoder_scale_q32;
}

/*
 * The frame has stopped with the counts, so remaining EMF means that the rotor turns. Detecting its presence needs less EMF
 * than its angle: three times the uncertainty, not four. With less: the error of the resistance is along the current, and the
 * EMF of a turning rotor is soon across it.
 */
static bool has_emf(const struct axis *a, const struct encoder_watch *e, bool enough)
{
    const int32_t across_q15 = q15_abs(e->emf.now.d_q15);
    if (enough) {
        return q15_max(across_q15, q15_abs(e->emf.now.q_q15)) > e->emf.expected_q15 / 3;
    }
    const int32_t drop_q15 = (a->tuning.r_q12 * q15_abs(a->loop.i_d_q15)) >> 12;
    return across_q15 > q15_max(e->emf.expected_q15, drop_q15 + (a->loop.vbus_q15 >> (ACROSS_SHIFT - 1))) / 2;
}

/* Counts stopped while the rotor turns: the encoder is dead. Rotor stopped, too: something has blocked the shaft. */
static void judge_still(struct axis *a, struct encoder_watch *e)
{
    const bool enough = e->emf.expected_q15 > 3 * e->emf.uncertain_q15;
    const bool left = has_emf(a, e, enough);
    const uint32_t samples = ++e->looked_ms * (uint32_t)a->tuning.loops_per_slow;
    e->turning_ms = left ? e->turning_ms + 1u : 0u;
    if (e->turning_ms >= (enough ? 1u : SUSPECT_BAD_MS)) {
        fault_report(a, FAULT_ENCODER_DEAD, 0, a->params.encoder_counts / a->params.pole_pairs);
    } else if (!left && (enough || (uint64_t)samples * angle_size_q32(e->speed_moving_q32) > DEGREES(STILL_TURN))) {
        e->speed_moving_q32 = 0;
        e->stopped = true;
    }
}

static void resolve_suspicion(struct axis *a, struct encoder_watch *e, bool stands)
{
    const bool clear = emf_is_clear(&e->emf);
    e->suspect_ms--;
    if (e->suspect_ms >= SUSPECT_MS - 1u) {
        return; /* the voltages of this millisecond are from before */
    }
    if (stands) {
        if (!e->stopped) {
            judge_still(a, e);
        }
        e->suspect_ms = e->stopped ? 0u : e->suspect_ms + (e->suspect_ms == 0u ? 1u : 0u);
        return;
    }
    if (clear && emf_judge_change(&e->emf, &e->emf_before, e->w_before_q15 < 0) == EMF_AGREES) {
        return;
    }
    e->against_ms++;
    if (!clear || e->against_ms >= SUSPECT_BAD_MS) {
        fault_report(a, FAULT_ENCODER_SLIP, degrees(e->jump_q32), 0);
    }
}

bool encoder_watch_offset_is_verified(const struct axis *a)
{
    return !a->start.remembered || a->supervision.encoder.agreed == AGREED_OFTEN;
}

/* No jump, but the EMF disagrees: counts lost gradually, or a jump at too little EMF. */
static void judge_by_emf(struct axis *a)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    const bool backwards = e->speed_before_q32 < 0;
    const enum emf_verdict verdict = emf_judge(&e->emf, backwards);
    if (verdict == EMF_AGREES) {
        e->agreed += e->agreed < AGREED_OFTEN ? 1u : 0u;
        e->against_ms = e->against_ms == 0u ? 0u : e->against_ms - 1u;
        return;
    }
    int32_t phase;
    if (phase_watch_suspects(a, &phase)) {
        return; /* the voltage of an open phase is not EMF: that is checked first */
    }
    e->against_ms += verdict == EMF_REVERSED ? 2u : 1u;
    if (e->against_ms >= TURNED_TIMES) {
        const enum fault cause = encoder_watch_offset_is_verified(a) ? FAULT_ENCODER_SLIP : FAULT_OFFSET;
        fault_report(a, cause, emf_angle_deg(&e->emf.filtered, backwards), 0);
    }
}

/* Gradual loss of counts shows as a rotation of the EMF at constant speed and current. */
static void watch_slip(struct axis *a, struct encoder_watch *e)
{
    int32_t phase;
    if (slip_watch_step(&e->slip, &e->emf, &a->loop, &a->tuning) && !phase_watch_suspects(a, &phase)) {
        fault_report(a, FAULT_ENCODER_SLIP, emf_angle_deg(&e->emf.filtered, e->speed_before_q32 < 0), 0);
    }
}

/* No count although the earlier speed should have given enough by now, or 1/share of it; until standstill is detected. */
static bool counts_are_due(const struct axis *a, uint32_t share)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    const uint32_t w_q15 = (uint32_t)q15_abs(w_of(a, e->speed_moving_q32));
    return w_q15 > (uint32_t)e->dead_w_q15 && e->still_ms * w_q15 * share > e->still_limit_q15;
}

bool encoder_watch_may_be_dead(const struct axis *a)
{
    return a->supervision.encoder.still_ms != 0u && counts_are_due(a, 4);
}

/*
 * An index deviation beyond a jump is a slip (lost counts) if the previous pulse deviated in the same direction; otherwise the
 * pulse itself may be wrong.
 */
static bool index_shows_slip(const struct axis *a, const struct encoder_watch *e, int32_t drift_before, int32_t drift)
{
    const bool again = drift < 0 ? drift_before < -INDEX_DRIFT : drift_before > INDEX_DRIFT;
    return again && (uint64_t)q15_abs(drift) * a->tuning.encoder_scale_q32 > e->jump_min_q32;
}

/*
 * An index pulse must come at the same count as the last one in this direction; it has a width, so each direction has its own
 * count.
 */
static void check_index(struct axis *a)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    const uint32_t now = encoder_index(&a->fabric->encoder);
    e->index = now;
    const uint32_t backwards = e->speed_before_q32 < 0 ? 1u : 0u;
    if (q15_abs(a->speed.speed_rpm_q4) < AXIS_STANDSTILL_RPM_Q4) {
        return; /* its direction is unknown */
    }
    if (!e->index_known[backwards]) {
        e->index_known[backwards] = true;
        e->index_first[backwards] = (int32_t)now;
    } else {
        const int32_t off = counts_between(a, (uint32_t)e->index_last[backwards], now);
        const int32_t drift = counts_between(a, (uint32_t)e->index_first[backwards], now);
        e->index_slip = index_shows_slip(a, e, e->index_drift, drift);
        e->index_drift = drift;
        if (q15_abs(off) > INDEX_COUNTS || q15_abs(drift) > INDEX_DRIFT) {
            fault_report(a, FAULT_ENCODER_COUNTS, drift, a->params.encoder_counts + (backwards == 0u ? off : -off));
        }
        if (e->index_slip) {
            const uint32_t drift_q32 = (uint32_t)drift * a->tuning.encoder_scale_q32;
            fault_report(a, FAULT_ENCODER_SLIP, degrees((int32_t)drift_q32), 0);
        }
    }
    e->index_last[backwards] = (int32_t)now;
}

int32_t encoder_watch_deviation_q32(const struct axis *a)
{
    const struct encoder_regs *const encoder = &a->fabric->encoder;
    const struct speed_estimate *const last = &a->speed.estimate;
    const int32_t moved = counts_between(a, last->count, encoder_latched(encoder));
    const uint32_t clocks = encoder_latch_clock(encoder) - last->latch_clock;
    return deviation_q32_of(&a->tuning, moved, clocks, a->supervision.encoder.speed_q32);
}

enum fault encoder_watch_blame(const struct axis *a, enum fault seen)
{
    const struct encoder_watch *const e = &a->supervision.encoder;
    const bool running = a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
    if (!running) {
        return seen;
    }
    if (e->suspect_ms == 0u && angle_size_q32(encoder_watch_deviation_q32(a)) <= e->jump_limit_q32) {
        return seen;
    }
    return counts_have_stopped(a, e->speed_q32) ? FAULT_ENCODER_DEAD : FAULT_ENCODER_SLIP;
}

/*
 * After a jump of the count the PLL's speed is wrong; the earlier one is used. If the counts have stopped, the frame stops,
 * too.
 */
static void check_suspect(struct axis *a, struct encoder_watch *e)
{
    const bool stands = counts_have_stopped(a, (int32_t)((uint32_t)e->w_before_q15 << a->loop.w_shift));
    const int32_t frame_w_q15 = stands ? current_loop_w_q15(&a->loop) : e->w_before_q15;
    emf_step(&e->emf, &a->loop, &a->tuning, e->w_before_q15, frame_w_q15);
    resolve_suspicion(a, e, stands);
}

/* Checks the encoder's angle by the EMF, if there is enough; and the index, if there was a pulse. */
static void encoder_watch_judge(struct axis *a, struct encoder_watch *e)
{
    if (emf_is_clear(&e->emf)) {
        judge_by_emf(a);
    } else if (e->against_ms != 0u) {
        e->against_ms--;
    }
    if (encoder_index(&a->fabric->encoder) != e->index) {
        check_index(a);
    }
}

/* Each millisecond while suspect, else every fourth. */
static void encoder_watch_check_emf(struct axis *a, struct encoder_watch *e, uint32_t turn)
{
    const int32_t w_q15 = current_loop_w_q15(&a->loop);
    if (e->suspect_ms != 0u) {
        check_suspect(a, e);
    } else if (e->still_ms >= STILL_MS && counts_are_due(a, 1)) {
        emf_step(&e->emf, &a->loop, &a->tuning, w_of(a, e->speed_moving_q32), w_q15);
        judge_still(a, e);
    } else if (turn == EMF_TURN) {
        emf_step(&e->emf, &a->loop, &a->tuning, w_q15, w_q15);
    } else if (turn % 2u == 0u) {
        watch_slip(a, e);
    } else if (turn == JUDGE_TURN) {
        encoder_watch_judge(a, e);
    }
}

/* Returns the count's deviation from its prediction. */
static int32_t check_count(struct axis *a, struct encoder_watch *e)
{
    const struct speed_estimate *const seen = &a->speed.estimate;
    const int32_t speed_q32 = e->speed_q32;
    if (seen->moved != 0) {
        e->still_ms = 0;
        e->looked_ms = 0;
        e->turning_ms = 0;
        e->stopped = false;
        e->speed_moving_q32 = e->speed_before_q32;
    } else {
        e->still_ms++;
    }
    e->speed_before_q32 = speed_q32;
    e->speed_q32 = a->loop.pll.speed_q32;
    return deviation_q32_of(&a->tuning, seen->moved, seen->step_clocks, speed_q32);
}

static void follow_usual(struct encoder_watch *e, uint32_t surprise_q32)
{
    const uint32_t faded_q32 = e->usual_q32 - (e->usual_q32 >> JUMP_SHIFT);
    const uint32_t max_q32 = surprise_q32 > faded_q32 ? surprise_q32 : faded_q32;
    e->usual_q32 = max_q32 > DEGREES(JUMP_MAX) ? DEGREES(JUMP_MAX) : max_q32;
    e->jump_limit_q32 = 2u * e->usual_q32 > e->jump_min_q32 ? 2u * e->usual_q32 : e->jump_min_q32;
}

bool encoder_watch_step(struct axis *a, uint32_t turn)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    const uint32_t reported = a->reports.count;
    const int32_t surprise_q32 = check_count(a, e);
    if (e->suspect_ms == 0u && angle_size_q32(surprise_q32) > e->jump_limit_q32) {
        begin_suspicion(a, e, surprise_q32);
    } else if (e->suspect_ms == 0u) {
        follow_usual(e, angle_size_q32(surprise_q32));
    }
    encoder_watch_check_emf(a, e, turn);
    return e->suspect_ms == 0u && a->reports.count == reported && a->failover.pending == FAULT_NONE;
}
