/* SPDX-License-Identifier: MIT */
#include "firmware/drive/handover.h"

#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/commission/pulses.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"
#include "firmware/drive/retune.h"
#include "firmware/drive/start.h"
#include "firmware/source/rotor.h"
#include "lib/polar.h"
#include "lib/q15.h"

/* ==== in the thread ==== */

/* The thread's part of a hand-over: its conditions, and the comparison of both angles. */

#define DEGREE_Q32   11930465
#define APART_Q32    (HANDOVER_APART_DEG * DEGREE_Q32)
#define LOOKS_MIN    64u
#define EMF_SETTLES  4u
#define EMF_MIN      8u
#define W_REF_Q15    3277
#define ENCODER_LOST (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)

void handover_forget(struct handover *h)
{
    h->offset_known = false;
}

/* ---- what forbids it ---- */

/* The margin increases with speed: the speed at which it suffices with this current. */
static int32_t min_rpm(const struct axis *a, int32_t i_q15)
{
    const int32_t margin_q8 = q15_max(observer_margin_q8(&a->tuning, i_q15, W_REF_Q15, a->loop.vbus_q15), 1);
    const int32_t w_q15 = q15_min(W_REF_Q15 * OBSERVER_LEADS_Q8 / margin_q8 + 1, INT16_MAX);
    return (tuning_rpm_q15(&a->tuning, w_q15 * (1 << a->loop.w_shift)) >> 15) + 1;
}

/* With the present current, and with none: the load may vanish. */
static struct outcome margin_is_too_small(const struct axis *a)
{
    const volatile struct current_loop *const c = &a->loop;
    const int32_t i_q15 = magnitude_q15(q15_sat16(c->i_d_ref_q15), q15_sat16(c->i_q_ref_q15));
    const int32_t w_q15 = current_loop_w_q15(c);
    const int32_t loaded_q8 = observer_margin_q8(&a->tuning, i_q15, w_q15, c->vbus_q15);
    const int32_t idle_q8 = observer_margin_q8(&a->tuning, 0, w_q15, c->vbus_q15);
    if (loaded_q8 >= OBSERVER_LEADS_Q8 && idle_q8 >= OBSERVER_LEADS_Q8) {
        return OUTCOME_OK;
    }
    return (struct outcome){ERROR_SOURCE_MARGIN, q15_max(min_rpm(a, i_q15), min_rpm(a, 0))};
}

/* According to what the target shows. */
static struct outcome has_no_signal(const struct axis *a, uint32_t target)
{
    const struct encoder_regs *const encoder = &a->fabric->encoder;
    if (source_has(target, SOURCE_COUNTS)) {
        return outcome_of((encoder_status(encoder) & ENCODER_LOST) != 0u ? ERROR_SOURCE_ENCODER : ERROR_NONE);
    }
    if (source_has(target, SOURCE_SWITCHES)) {
        const bool valid = hall_state_is_valid(&a->hall, encoder_hall_latched(encoder));
        return outcome_of(valid ? ERROR_NONE : ERROR_SOURCE_HALL);
    }
    return margin_is_too_small(a);
}

struct outcome handover_forbidden(const struct axis *a, uint32_t target)
{
    if (a->state != AXIS_OPERATION_ENABLED || a->failover.pending != FAULT_NONE) {
        return outcome_of(ERROR_NOT_OPERATING);
    }
    if (a->mode != AXIS_MODE_SPEED && a->mode != AXIS_MODE_TORQUE) {
        return outcome_of(ERROR_SOURCE_MODE);
    }
    if (!source_has(target, SOURCE_WEAKENS) && a->tuning.weakens) {
        return outcome_of(ERROR_SOURCE_WEAKENS);
    }
    if (source_has(target, SOURCE_ESTIMATES) && a->tuning.reluctant) {
        return outcome_of(ERROR_SOURCE_RELUCTANT);
    }
    if (!rotor_is_known(a)) {
        return outcome_of(ERROR_SOURCE_FIELD);
    }
    return has_no_signal(a, target);
}

/* Checks the parameters as `on` would with that source. */
static struct outcome handover_tune(struct axis *a, uint32_t target)
{
    struct params wanted = a->params;
    struct tuning *const t = &a->switching.tuning;
    wanted.angle_source = (int32_t)target;
    *t = a->tuning;
    const struct outcome problem = tuning_compute(&wanted, t);
    a->handover.speed_ki_min_q16 = t->speed_ki_min_q16;
    return problem;
}

/* ---- begin ---- */

/* Latches may be old; one that still applies is set again immediately. */
static void wake_encoder(struct axis *a)
{
    if ((encoder_status(&a->fabric->encoder) & ENCODER_LOST) != 0u) {
        handover_forget(&a->handover);
        encoder_clear(&a->fabric->encoder, ENCODER_LOST);
    }
}

static void wake_hall(struct axis *a)
{
    struct hall_table table;
    (void)hall_table_of(&a->params, &table); /* checked with the tuning */
    hall_take_table(&a->hall, &table, &a->tuning);
    start_filter_hall(a);
}

static void begin_comparison(struct axis *a, uint32_t target)
{
    struct handover *const h = &a->handover;
    *h = (struct handover){.under_way = true,
                           .target = target,
                           .speed_ki_min_q16 = h->speed_ki_min_q16,
                           .offset_known = h->offset_known,
                           .offset_q32 = h->offset_q32,
                           .begun_ms = a->time_ms,
                           .sequence = adc_sequence(&a->fabric->adc),
                           .emf_ms = a->time_ms};
    emf_reset(&h->emf, &a->tuning);
}

struct outcome drive_change_source(struct axis *a, uint32_t target)
{
    const struct outcome absent = features_allow_source((int32_t)target);
    if (FEATURE_SOURCES == 1 || absent.error != ERROR_NONE) {
        return absent;
    }
    if (a->handover.under_way || !request_settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    a->handover.outcome = OUTCOME_OK;
    if (a->tuning.angle_source == target) {
        return OUTCOME_OK;
    }
    if (a->state != AXIS_OPERATION_ENABLED) {
        return outcome_of(ERROR_NOT_OPERATING);
    }
    struct outcome problem = handover_tune(a, target);
    if (problem.error == ERROR_NONE && source_has(target, SOURCE_COUNTS)) {
        wake_encoder(a);
    }
    if (problem.error == ERROR_NONE && source_has(target, SOURCE_SWITCHES)) {
        wake_hall(a);
    }
    if (problem.error == ERROR_NONE) {
        problem = handover_forbidden(a, target);
    }
    if (problem.error == ERROR_NONE) {
        begin_comparison(a, target);
    }
    return problem;
}

/* ---- the comparison ---- */

static void handover_differ(struct handover *h, int32_t by_q32)
{
    const int32_t size_q32 = by_q32 < 0 ? -(by_q32 + 1) : by_q32;
    h->apart_q32 = q15_max(h->apart_q32, size_q32);
}

/* The distance from its count to the angle must stay constant. */
static void look_at_encoder(struct handover *h, uint32_t from_count_q32)
{
    if (h->samples == 0u) {
        h->first_q32 = h->offset_known ? h->offset_q32 : from_count_q32;
    }
    const int32_t off_q32 = (int32_t)(from_count_q32 - h->first_q32);
    h->sum_q32 += off_q32;
    h->min_q32 = q15_min(h->min_q32, off_q32);
    h->max_q32 = q15_max(h->max_q32, off_q32);
    if (h->offset_known) {
        handover_differ(h, off_q32);
    } else {
        handover_differ(h, (int32_t)(((int64_t)h->max_q32 - h->min_q32) / 2));
    }
}

/* How far the angle is outside the sector they show. */
static void look_at_hall(struct axis *a, uint32_t state, uint32_t angle_q32)
{
    struct handover *const h = &a->handover;
    const struct hall_sector *const s = &a->hall.sector[state];
    const int32_t off_q32 = (int32_t)(angle_q32 - s->middle_q32);
    const int32_t size_q32 = off_q32 < 0 ? -(off_q32 + 1) : off_q32;
    h->states |= 1u << state;
    if (hall_state_is_valid(&a->hall, state)) {
        handover_differ(h, q15_max(size_q32 - s->half_q32, 0));
    }
}

/* Once a millisecond, when the slow loop has updated the voltages. */
static void handover_compare_emf(struct axis *a)
{
    struct handover *const h = &a->handover;
    const uint32_t held = request_hold();
    const int32_t w_q15 = current_loop_w_q15(&a->loop);
    if (a->time_ms != h->emf_ms) {
        h->emf_ms = a->time_ms;
        emf_step(&h->emf, &a->loop, &a->tuning, w_q15, w_q15);
        h->states++;
        if (h->states > EMF_SETTLES && emf_judge(&h->emf, w_q15 < 0) != EMF_AGREES) {
            const int32_t deg = emf_angle_deg(&h->emf.filtered, w_q15 < 0);
            handover_differ(h, deg == 180 || deg == -180 ? INT32_MAX : deg * DEGREE_Q32);
        }
    }
    request_release(held);
}

/* Data of one sample whose interrupt has finished. */
struct sample {
    uint32_t sequence, clock, angle_q32, count, state;
};

/* False if another sample has come meanwhile. */
static bool read_sample(const struct axis *a, struct sample *s)
{
    const struct encoder_regs *const encoder = &a->fabric->encoder;
    s->sequence = adc_sequence(&a->fabric->adc);
    s->clock = encoder_latch_clock(encoder);
    const uint32_t mask = cpu_irq_save();
    s->angle_q32 = current_loop_angle_q32(&a->loop) - (uint32_t)((const volatile struct axis *)a)->loop.pll.speed_q32;
    s->count = encoder_latched(encoder);
    s->state = encoder_hall_latched(encoder);
    const bool one = s->sequence == adc_sequence(&a->fabric->adc) && s->clock == encoder_latch_clock(encoder);
    cpu_irq_restore(mask);
    return one;
}

static void look_at_sample(struct axis *a)
{
    struct handover *const h = &a->handover;
    struct sample s;
    if (!read_sample(a, &s) || s.sequence == h->sequence) {
        return;
    }
    if (source_has(h->target, SOURCE_COUNTS)) {
        look_at_encoder(h, s.angle_q32 - s.count * a->loop.encoder_scale_q32);
    } else if (source_has(h->target, SOURCE_SWITCHES)) {
        look_at_hall(a, s.state, s.angle_q32);
    }
    h->travel_q32 += h->samples == 0u ? 0 : (int32_t)(s.angle_q32 - h->angle_q32);
    h->angle_q32 = s.angle_q32;
    h->sequence = s.sequence;
    h->samples++;
}

static bool is_complete(const struct handover *h)
{
    const bool turned = (h->travel_q32 < 0 ? -h->travel_q32 : h->travel_q32) >> 32 != 0;
    if (source_has(h->target, SOURCE_ESTIMATES) && h->states < EMF_MIN) {
        return false;
    }
    return turned && h->samples >= LOOKS_MIN;
}

/* All six states of the table within a turn, or some are not the switches' own. */
static bool all_states(const struct axis *a)
{
    uint32_t expected = 0;
    for (uint32_t state = 0; state < HALL_STATES; state++) {
        expected |= hall_state_is_valid(&a->hall, state) ? 1u << state : 0u;
    }
    return a->handover.states == expected;
}

static struct outcome handover_judge(const struct axis *a)
{
    const struct handover *const h = &a->handover;
    if (source_has(h->target, SOURCE_SWITCHES) && !all_states(a)) {
        return outcome_of(ERROR_SOURCE_HALL);
    }
    if (h->apart_q32 > APART_Q32) {
        return (struct outcome){ERROR_SOURCE_APART, h->apart_q32 / DEGREE_Q32 + 1};
    }
    return OUTCOME_OK;
}

/* ---- in progress ---- */

static void end(struct handover *h, struct outcome outcome)
{
    h->outcome = outcome;
    h->under_way = false;
}

/* A turn in the time of the comparison. */
static int32_t min_turn_rpm(const struct axis *a)
{
    return 60000 / ((int32_t)HANDOVER_COMPARE_MS * a->params.pole_pairs) + 1;
}

/* Requests the hand-over from the slow loop, with the encoder's offset as found by the comparison. */
static void ask_slow_loop(struct axis *a)
{
    struct handover *const h = &a->handover;
    const uint32_t held = request_hold();
    const struct outcome problem = handover_forbidden(a, h->target);
    if (problem.error != ERROR_NONE) {
        end(h, problem);
    } else if (a->request == AXIS_REQUEST_NONE) {
        if (source_has(h->target, SOURCE_COUNTS) && !h->offset_known) {
            h->offset_q32 = h->first_q32 + (uint32_t)(int32_t)(h->sum_q32 / (int32_t)h->samples);
        }
        h->asked = true;
        a->request = AXIS_REQUEST_SOURCE;
    }
    request_release(held);
}

static void handover_compare(struct axis *a)
{
    struct handover *const h = &a->handover;
    if (source_has(h->target, SOURCE_ESTIMATES)) {
        handover_compare_emf(a);
    }
    look_at_sample(a);
    if (is_complete(h)) {
        const struct outcome found = handover_judge(a);
        if (found.error != ERROR_NONE) {
            end(h, found);
        } else {
            ask_slow_loop(a);
        }
    } else if (a->time_ms - h->begun_ms > HANDOVER_COMPARE_MS) {
        end(h, (struct outcome){ERROR_SOURCE_SLOW, min_turn_rpm(a)});
    }
}

/* The slow loop's clock has stopped. */
static bool slow_loop_is_dead(struct axis *a)
{
    struct handover *const h = &a->handover;
    const uint32_t now_ms = a->time_ms;
    h->polls = now_ms == h->polled_ms ? h->polls + 1u : 0u;
    h->polled_ms = now_ms;
    return h->polls > REQUEST_TIMEOUT_POLLS;
}

bool handover_poll(struct axis *a)
{
    struct handover *const h = &a->handover;
    if (slow_loop_is_dead(a)) {
        end(h, outcome_of(ERROR_BUSY));
    } else if (h->asked) {
        if (a->request != AXIS_REQUEST_SOURCE && h->under_way) {
            end(h, outcome_of(ERROR_NOT_OPERATING)); /* a fault or `off` came first */
        }
    } else if (a->state != AXIS_OPERATION_ENABLED) {
        end(h, outcome_of(ERROR_NOT_OPERATING));
    } else {
        handover_compare(a);
    }
    return h->under_way;
}

/* ==== in the slow loop ==== */

/* The slow loop's part: makes all changes right after a sample. */

/* Cogging torque is compensated only with an encoder; otherwise the speed loop's integral contains it. */
static int32_t known_torque_q15(struct axis *a)
{
    const bool known = rotor_has_encoder(a) && (a->motion.cogging.count | a->tuning.friction_q15) != 0;
    return known ? modes_feedforward_torque_q15(a) : 0;
}

static void leave(struct axis *a)
{
    struct handover *const h = &a->handover;
    if (rotor_has_encoder(a)) {
        h->offset_known = a->start.aligned;
        h->offset_q32 = a->loop.angle_offset_q32;
    }
    start_forget(a);
    a->failover.cause = FAULT_NONE;
}

/* ---- from the next sample on; interrupts are held ---- */

static void by_encoder(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const uint32_t count_q32 = encoder_latched(&a->fabric->encoder) * c->encoder_scale_q32;
    const struct pll rotor = {count_q32 + (uint32_t)c->pll.speed_q32, c->pll.speed_q32};
    current_loop_hand_over(c, LOOP_ENCODER, &rotor, a->handover.offset_q32);
}

/* The frame's angle stays; the Hall switches limit it to their sector. */
static void by_hall(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const struct pll rotor = {current_loop_angle_q32(c), c->pll.speed_q32};
    current_loop_hand_over(c, LOOP_HALL, &rotor, 0);
    hall_resume(&a->hall, c, &a->fabric->encoder, a->torque.torque_q15);
}

static void by_observer(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const struct pll rotor = {current_loop_angle_q32(c), c->pll.speed_q32};
    current_loop_forget_injection(c);
    current_loop_hand_over(c, LOOP_OBSERVER, &rotor, 0);
    observer_slow_down(c);
    observer_begin(c, &a->tuning);
    observer_preset(c, &a->tuning);
}

/* ---- what follows from it ---- */

/* The shaft has turned without being counted: the position reference is lost. */
static void begin_encoder(struct axis *a)
{
    a->start.aligned = true;
    a->motion.homed = false;
    speed_estimate_resume(&a->speed.estimate, &a->fabric->encoder);
}

static void begin_watching(struct axis *a)
{
    if (rotor_has_hall(a)) {
        hall_watch_begin(a);
    }
    a->sensorless = (struct sensorless){.ref_rpm_q16 = a->speed.ref_rpm_q16};
    supervision_begin(a);
}

static void change(struct axis *a)
{
    const uint32_t target = a->handover.target;
    const int32_t known_q15 = known_torque_q15(a);
    emf_pulse_wait(a->fabric, 1);
    const uint32_t mask = cpu_irq_save();
    leave(a);
    if (source_has(target, SOURCE_COUNTS)) {
        by_encoder(a);
    } else if (source_has(target, SOURCE_SWITCHES)) {
        by_hall(a);
    } else {
        by_observer(a);
    }
    cpu_irq_restore(mask);
    retune_source(a, target, a->handover.speed_ki_min_q16);
    current_loop_restart_feedforward(&a->loop, a->fabric, &a->tuning);
    if (source_has(target, SOURCE_COUNTS)) {
        begin_encoder(a);
    }
    a->speed.integral_q29 += (known_q15 - known_torque_q15(a)) * (1 << 14);
    begin_watching(a);
}

void handover_take(struct axis *a)
{
    struct handover *const h = &a->handover;
    h->outcome = handover_forbidden(a, h->target);
    if (h->outcome.error == ERROR_NONE) {
        change(a);
    }
    h->under_way = false;
}
