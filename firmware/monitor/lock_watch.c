/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/lock_watch.h"

#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/control/emf.h"
#include "firmware/source/rotor.h"
#include "lib/advance.h"
#include "lib/q15.h"

/* ==== Hall switches ==== */

#define INVALID_SAMPLES     2u /* in a millisecond: at maximum speed a state lasts longer */
#define OFF_Q32             (15u * 11930464u)
#define AT_END_Q32          (1 << 24) /* 1.4 degrees */
#define EMF_SHIFT           4         /* 16 ms */
#define EMF_WRONG_MS        60u
#define UNCERTAIN_BUS_SHIFT 6 /* dead time */

/* ---- where the rotor is ---- */

/* By the frame, at the last sample. */
static struct rotor_seed by_switches(const struct axis *a)
{
    const volatile struct current_loop *const c = &a->loop;
    const uint32_t mask = cpu_irq_save();
    const int32_t speed_q32 = c->pll.speed_q32;
    const struct rotor_seed now = {.angle_q32 = current_loop_angle_q32(c) - (uint32_t)speed_q32,
                                   .clock = encoder_latch_clock(&a->fabric->encoder),
                                   .speed_q32 = speed_q32};
    cpu_irq_restore(mask);
    return now;
}

static uint32_t expected_q32(const struct axis *a, uint32_t clock)
{
    const struct rotor_seed *const s = &a->hall_watch.sound;
    const uint32_t loop_counts = (uint32_t)a->tuning.loop_counts;
    return s->angle_q32 + (clock - s->clock + loop_counts / 2u) / loop_counts * (uint32_t)s->speed_q32;
}

static bool far_off(uint32_t angle_q32, uint32_t from_q32)
{
    return angle_q32 - from_q32 + OFF_Q32 > 2u * OFF_Q32;
}

/* The angle is limited to the end of its sector until an edge comes. */
static bool waits_for_edge(const struct axis *a, const struct rotor_seed *now)
{
    const struct hall_sector *const s = &a->hall.sector[((const volatile struct hall *)&a->hall)->state];
    const int32_t off_q32 = (int32_t)(now->angle_q32 - s->middle_q32);
    return (now->speed_q32 < 0 ? (int32_t)(0u - (uint32_t)off_q32) : off_q32) > s->half_q32 - AT_END_Q32;
}

/* Travel by the earlier speed or by the switches, whichever is more, so that a starting rotor is soon accepted. */
static bool for_a_turn(struct axis *a, const struct rotor_seed *now)
{
    struct hall_watch *const w = &a->hall_watch;
    const int32_t speed_q32 = q15_max(q15_abs(w->sound.speed_q32), q15_abs(now->speed_q32));
    w->suspect_turns_q16 += ((uint32_t)speed_q32 >> 8) * (uint32_t)a->tuning.loops_per_slow >> 8;
    return w->suspect_turns_q16 >> 16 != 0u;
}

/* A wrong edge affects the speed for longer than the angle, so the earlier speed is kept for a turn. */
static bool suspects(struct axis *a, const struct rotor_seed *now, bool far)
{
    struct hall_watch *const w = &a->hall_watch;
    if (w->suspect_ms == 0u) {
        w->suspect_turns_q16 = 0;
        return far && w->sound.speed_q32 != 0;
    }
    return !for_a_turn(a, now);
}

static void hall_watch_follow(struct axis *a)
{
    struct hall_watch *const w = &a->hall_watch;
    const struct rotor_seed now = by_switches(a);
    const uint32_t angle_q32 = expected_q32(a, now.clock);
    const bool far = far_off(now.angle_q32, angle_q32);
    const bool suspect = suspects(a, &now, far);
    w->suspect_ms = suspect ? w->suspect_ms + 1u : 0u;
    if (suspect || (waits_for_edge(a, &now) && !far)) {
        w->sound.angle_q32 = angle_q32;
        w->sound.clock = now.clock;
    } else {
        w->sound = now;
    }
    w->torque_q29 = suspect ? w->torque_q29 : a->speed.integral_q29;
}

int32_t hall_watch_torque_q29(const struct axis *a)
{
    return a->hall_watch.suspect_ms != 0u ? a->hall_watch.torque_q29 : a->speed.integral_q29;
}

/* ---- states and sequence ---- */

static void take_counts(struct axis *a)
{
    const volatile struct hall *const h = &a->hall;
    a->hall_watch.invalid = h->invalid;
    a->hall_watch.skipped = h->skipped;
}

/* ---- the EMF ---- */

/* A hot winding has up to two fifths more resistance than the parameter; 3/4 of the resistive drop is allowed for. */
static bool emf_is_elsewhere(struct axis *a)
{
    struct hall_watch *const w = &a->hall_watch;
    const int32_t w_q15 = current_loop_w_q15(&a->loop);
    const int32_t drop_q15 = (a->tuning.r_q12 * q15_abs(a->loop.i_q_q15)) >> 12;
    const int32_t hidden_q15 = drop_q15 - drop_q15 / 4 + (a->loop.vbus_q15 >> UNCERTAIN_BUS_SHIFT);
    w->emf_q4 += (emf_along_q15(&a->loop, &a->tuning, w_q15) * 16 - w->emf_q4) >> EMF_SHIFT;
    w->expected_q4 += (emf_expected_q15(&a->tuning, w_q15) * 16 - w->expected_q4) >> EMF_SHIFT;
    const bool enough = w->expected_q4 > 16 * hidden_q15;
    return enough && w->emf_q4 < w->expected_q4 / 2;
}

static void watch_emf(struct axis *a)
{
    struct hall_watch *const w = &a->hall_watch;
    const bool wrong = emf_is_elsewhere(a);
    w->wrong_ms = wrong ? w->wrong_ms + 1u : (w->wrong_ms > 0u ? w->wrong_ms - 1u : 0u);
    if (w->wrong_ms >= EMF_WRONG_MS) {
        w->wrong_ms = 0;
        fault_report(a, FAULT_HALL_SEQUENCE, (int32_t)encoder_hall_latched(&a->fabric->encoder), 0);
    }
}

void hall_watch_begin(struct axis *a)
{
    a->hall_watch = (struct hall_watch){.sound = by_switches(a)};
    take_counts(a);
}

/* One millisecond of operation with Hall switches; may raise a fault. Slow loop. */
static void hall_watch_step(struct axis *a)
{
    const uint32_t invalid = a->hall_watch.invalid;
    const uint32_t skipped = a->hall_watch.skipped;
    take_counts(a);
    hall_watch_follow(a);
    if (a->hall_watch.invalid - invalid >= INVALID_SAMPLES) {
        fault_report(a, FAULT_HALL_INVALID, (int32_t)encoder_hall_latched(&a->fabric->encoder), 0);
    } else if (a->hall_watch.skipped != skipped) {
        fault_report(a, FAULT_HALL_SEQUENCE, (int32_t)encoder_hall_latched(&a->fabric->encoder), 0);
    } else {
        watch_emf(a);
    }
}

enum fault hall_watch_blame(const struct axis *a, enum fault seen)
{
    const struct rotor_seed now = by_switches(a);
    const bool running = a->state == AXIS_OPERATION_ENABLED && a->loop.source == LOOP_HALL;
    return running && far_off(now.angle_q32, expected_q32(a, now.clock)) ? FAULT_HALL_SEQUENCE : seen;
}

/* ==== a prescribed field ==== */

#define FILTER_SHIFT 2 /* 4 ms: the noise of the voltages */
#define MIN_SHIFT    6 /* a 64th of the bus: less EMF is not evaluated */
#define MISSING      2 /* points a millisecond, */
#define OPPOSITE     4
#define THERE        (-1)

void field_watch_reset(struct field_watch *w)
{
    *w = (struct field_watch){0};
}

struct field_view {
    int32_t d_q15, q_q15; /* e; q along the field's speed */
    int32_t expected_q15, uncertainty_q15;
};

static struct field_view field_watch_look(const struct axis *a)
{
    const struct tuning *const t = &a->tuning;
    const volatile struct current_loop *const c = &a->loop;
    const int32_t w_q15 = q15_sat16(c->field_speed_q32 >> c->w_shift);
    int32_t v_d_q15 = c->v_d_q15;
    int32_t v_q_q15 = c->v_q_q15;
    advance_q15(&v_d_q15, &v_q_q15, -c->v_turn_q15);
    const int32_t armature_q15 = tuning_reactive_q15(w_q15, c->i_d_q15, t->x_q_apparent_q11);
    const int32_t q_q15 = v_q_q15 - ((t->r_q12 * c->i_q_q15) >> 12) - armature_q15;
    const int32_t drop_q15 = (t->r_q12 * c->i_d_q15) >> 12;
    return (struct field_view){
        .d_q15 = v_d_q15 - drop_q15,
        .q_q15 = w_q15 < 0 ? -q_q15 : q_q15,
        .expected_q15 = emf_expected_q15(t, w_q15),
        .uncertainty_q15 =
            ((q15_abs(drop_q15) * OBSERVER_R_UNCERTAINTY_Q8) >> 8) + (c->vbus_q15 >> OBSERVER_BUS_UNCERTAINTY_SHIFT),
    };
}

static int32_t filtered(int32_t mean_q4, int32_t now_q15)
{
    return mean_q4 + ((now_q15 * 16 - mean_q4) >> FILTER_SHIFT);
}

/* This millisecond's points: does either component fit a rotor that follows? */
static int32_t points(const struct field_watch *w, const struct field_view *v)
{
    if (w->q_q4 * 2 < -w->expected_q4) {
        return OPPOSITE;
    }
    const bool missing =
        w->q_q4 * 4 < w->expected_q4 && q15_abs(w->d_q4) < w->expected_q4 / 2 + v->uncertainty_q15 * 16;
    return missing ? MISSING : THERE;
}

/* Twice the EMF of the field's speed, and several times the uncertainty: a load drives the rotor faster. */
static bool is_away(const struct field_view *v, int32_t vbus_q15)
{
    const int32_t seen_q15 = q15_max(q15_abs(v->d_q15), q15_abs(v->q_q15));
    return seen_q15 > 2 * v->expected_q15 + 3 * v->uncertainty_q15 + (vbus_q15 >> MIN_SHIFT);
}

void field_watch_step(struct axis *a)
{
    struct field_watch *const w = &a->field_watch;
    const struct field_view v = field_watch_look(a);
    const bool enough = v.expected_q15 > a->loop.vbus_q15 >> MIN_SHIFT;
    if (!enough) {
        w->d_q4 = 0;
        w->q_q4 = 0;
        w->expected_q4 = 0;
    } else {
        w->d_q4 = filtered(w->d_q4, v.d_q15);
        w->q_q4 = filtered(w->q_q4, v.q_q15);
        w->expected_q4 = filtered(w->expected_q4, v.expected_q15);
    }
    const int32_t now = is_away(&v, a->loop.vbus_q15) ? MISSING : enough ? points(w, &v) : THERE;
    w->out = q15_max(w->out + now, 0);
    if (w->out >= FIELD_WATCH_POINTS) {
        const int32_t percent = scale_clamp(100LL * w->q_q4 / q15_max(w->expected_q4, 1), INT32_MIN, INT32_MAX);
        fault_report(a, FAULT_OUT_OF_STEP, percent, a->loop.flux.margin_q8 * 10 / 256);
    }
}

/* ---- observer and injection ---- */

#define LOST_MS      10u
#define LOST_RHO_Q15 9830            /* 0.3 */
#define LOST_MARGIN  (256 * 15 / 10) /* observer.h */

void lock_watch_begin(struct lock_watch *w)
{
    *w = (struct lock_watch){.lost_ms = 0};
}

/* The EMF must be 0.7 to 1.3 of that of the estimated speed. */
static bool emf_contradicts(const struct axis *a)
{
    if (a->tuning.observer.lq_more != 0) {
        return false; /* with saturation, q currents contribute to the EMF */
    }
    const int32_t w_q15 = current_loop_w_q15(&a->loop);
    const int32_t expected_q15 = emf_expected_q15(&a->tuning, w_q15);
    return q15_abs(emf_along_q15(&a->loop, &a->tuning, w_q15) - expected_q15) >
           expected_q15 * 3 / 10 + expected_q15 * 256 / q15_max(a->loop.flux.margin_q8, 1);
}

bool lock_watch_suspects(const struct axis *a)
{
    return rotor_is_sensorless(a) && a->lock_watch.lost_ms != 0u;
}

static void count(struct axis *a, bool lost, int32_t detail)
{
    struct lock_watch *const w = &a->lock_watch;
    w->lost_ms = lost ? w->lost_ms + 1u : 0u;
    if (w->lost_ms >= LOST_MS) {
        fault_report(a, FAULT_LOCK_LOST, detail, a->loop.flux.margin_q8 * 10 / 256);
    }
}

/*
 * The current response along the low-inductance axis exceeds the mean of both axes, and saturation increases it; so a response
 * below the mean belongs to another axis.
 */
static void watch_injection(struct axis *a)
{
    const int32_t mean = injection_take(&a->loop).d / a->tuning.loops_per_slow;
    const int32_t least = (a->injection.straight * a->loop.inject.share_q8) >> 8;
    count(a, mean < least, 100 - mean * 100 / q15_max(least, 1));
}

static void watch_observer(struct axis *a)
{
    const volatile struct current_loop *const c = &a->loop;
    const int32_t rho_q15 = c->flux.rho_q15;
    const bool lost = q15_abs(rho_q15) > LOST_RHO_Q15 || c->flux.margin_q8 < LOST_MARGIN || emf_contradicts(a);
    count(a, lost, rho_q15 * 100 / Q15_ONE);
}

static void watch_lead(struct axis *a)
{
    struct lock_watch *const w = &a->lock_watch;
    if (w->source != (uint32_t)a->loop.source) {
        w->source = (uint32_t)a->loop.source;
        w->lost_ms = 0;
    }
    field_watch_reset(&a->field_watch);
    if (injection_leads(a)) {
        watch_injection(a);
    } else {
        watch_observer(a);
    }
}

/* ---- the present source ---- */

bool lock_watch_step(struct axis *a)
{
    const uint32_t reported = a->reports.count;
    if (rotor_has_hall(a)) {
        hall_watch_step(a);
    } else if (rotor_is_known(a)) {
        watch_lead(a);
    } else {
        a->lock_watch.lost_ms = 0;
        field_watch_step(a);
    }
    return a->reports.count == reported && a->failover.pending == FAULT_NONE;
}
