/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/phase_watch.h"

#include "firmware/axis/axis.h"
#include "lib/advance.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define SIN60_Q15         28378
#define MIN_SHIFT         4 /* a sixteenth of i_max */
#define ALL_SHIFT         4 /* weight if no phase follows its reference */
#define CONDUCTED_SHIFT   2 /* decay of earlier currents: 0.75 per step */
#define CLAMPED_BUS_SHIFT 4 /* of the bus: three times the error of 1 us dead time at 20 kHz, of either sign */
#define HELD_BUS_SHIFT    5 /* of a held voltage, which does not grow with an open phase: half of it */
#define SUSPECT           2 /* of the smallest terms: a phase that may cause another fault */

/* Number of the phase: 1, 2, 3; 0 if more than one. */
static int32_t open_one(bool a, bool b, bool c)
{
    return a + b + c == 1 ? a + 2 * b + 3 * c : 0;
}

static abc_t phases_of(int32_t d_q15, int32_t q_q15, const cossin_t *cs)
{
    const int32_t alpha_q15 = (d_q15 * cs->cos - q_q15 * cs->sin) >> 15;
    const int32_t beta_q15 = (d_q15 * cs->sin + q_q15 * cs->cos) >> 15;
    const int32_t b_q15 = ((beta_q15 * SIN60_Q15) >> 15) - (alpha_q15 >> 1);
    return (abc_t){alpha_q15, b_q15, -alpha_q15 - b_q15};
}

static int32_t phases_size(const abc_t *i)
{
    return q15_abs(i->a) + q15_abs(i->b) + q15_abs(i->c);
}

/*
 * The reference may be 15 degrees off: a fast rotor turns by that in a period or two. So near its zero crossing an intact phase
 * may have no current, and at 500 Hz every step may fall there.
 */
static int32_t min_current_q15(const struct phase_watch *p, const abc_t *asked)
{
    return q15_max(p->min_q15, phases_size(asked) / 5); /* phases_size() is 1.73 to 2 times the amplitude */
}

enum phase_look {
    PHASE_UNKNOWN,
    PHASE_CONDUCTS,
    PHASE_MISSING,
};

/* A phase with an eighth of its reference is intact; one with less may be clamped. */
static enum phase_look check_phase(int32_t asked_q15, int32_t measured_q15, int32_t min_q15, bool clamped)
{
    const int32_t size_q15 = q15_abs(asked_q15);
    if (size_q15 < min_q15) {
        return PHASE_UNKNOWN;
    }
    if (q15_abs(measured_q15) >= size_q15 >> 3) {
        return PHASE_CONDUCTS;
    }
    return clamped ? PHASE_UNKNOWN : PHASE_MISSING;
}

/*
 * A phase with less is open once its references, every second millisecond, add up to half of i_max, each limited to a quarter
 * of it: a rising current at the voltage limit may cross zero once or twice.
 */
static bool open(struct phase_watch *p, uint32_t phase, enum phase_look look, int32_t asked_q15, uint32_t weight_shift)
{
    if (look == PHASE_UNKNOWN) {
        return false;
    }
    const int32_t counts_q15 = q15_min(q15_abs(asked_q15), p->min_q15 << (MIN_SHIFT - 2));
    p->missing_q15[phase] = look == PHASE_CONDUCTS ? 0 : p->missing_q15[phase] + (counts_q15 >> weight_shift);
    return p->missing_q15[phase] > p->min_q15 << (MIN_SHIFT - 1);
}

/*
 * If no phase conducts, the voltage may be insufficient: the decision takes longer. But with one phase open the other two do
 * not conduct when its reference is largest, so their currents of earlier steps count, too.
 */
static uint32_t weight_shift(struct phase_watch *p, const abc_t *asked, const abc_t *measured, bool any_carries)
{
    p->conducted_q15 = q15_max(phases_size(measured), p->conducted_q15 - (p->conducted_q15 >> CONDUCTED_SHIFT));
    return any_carries && p->conducted_q15 > phases_size(asked) >> 1 ? 0u : ALL_SHIFT;
}

/* A voltage is held, during a start: the currents follow a moved field slowly. */
static bool is_held(const struct axis *a)
{
    return a->state == AXIS_SWITCHED_ON && a->loop.kp_d_q9 == 0;
}

/*
 * Phases whose voltage is so small that dead time may explain the missing current: during a start currents may be regulated
 * along one axis only, or slowly. An open phase soon has more. 0 if the voltages are inconclusive.
 */
static abc_t clamped_phases(const struct axis *a, const cossin_t *cs)
{
    if (a->state != AXIS_SWITCHED_ON) {
        return (abc_t){0, 0, 0};
    }
    const int32_t hidden_q15 = a->loop.vbus_q15 >> (is_held(a) ? HELD_BUS_SHIFT : CLAMPED_BUS_SHIFT);
    int32_t v_d_q15 = a->loop.v_d_q15;
    int32_t v_q_q15 = a->loop.v_q_q15;
    advance_q15(&v_d_q15, &v_q_q15, -a->loop.v_turn_q15);
    const abc_t v = phases_of(v_d_q15, v_q_q15, cs);
    return (abc_t){q15_abs(v.a) < hidden_q15, q15_abs(v.b) < hidden_q15, q15_abs(v.c) < hidden_q15};
}

void phase_watch_expect(struct axis *a)
{
    a->supervision.phases.i_d_ref_q15 = a->loop.i_d_ref_q15;
    a->supervision.phases.i_q_ref_q15 = a->loop.i_q_ref_q15;
}

void phase_watch_step(struct axis *a)
{
    struct phase_watch *const p = &a->supervision.phases;
    const cossin_t cs = cossin_q15(current_loop_angle_q32(&a->loop));
    const abc_t asked = phases_of(p->i_d_ref_q15, p->i_q_ref_q15, &cs);
    const abc_t measured = {a->fabric->adc.IA, a->fabric->adc.IB, a->fabric->adc.IC};
    const int32_t min_q15 = min_current_q15(p, &asked);
    const abc_t clamped = clamped_phases(a, &cs);
    const enum phase_look of_a = check_phase(asked.a, measured.a, min_q15, clamped.a);
    const enum phase_look of_b = check_phase(asked.b, measured.b, min_q15, clamped.b);
    const enum phase_look of_c = check_phase(asked.c, measured.c, min_q15, clamped.c);
    const bool any_carries = of_a == PHASE_CONDUCTS || of_b == PHASE_CONDUCTS || of_c == PHASE_CONDUCTS;
    const uint32_t shift = is_held(a) ? ALL_SHIFT : weight_shift(p, &asked, &measured, any_carries);
    const bool a_open = open(p, 0, of_a, asked.a, shift);
    const bool b_open = open(p, 1, of_b, asked.b, shift);
    const bool c_open = open(p, 2, of_c, asked.c, shift);
    if ((a_open || b_open || c_open) && !lock_watch_suspects(a)) {
        const bool led = a->state != AXIS_SWITCHED_ON; /* in I-f control the rotor may be out of step */
        fault_report(a, led && field_watch_suspects(&a->field_watch) ? FAULT_OUT_OF_STEP : FAULT_OPEN_PHASE,
                     open_one(a_open, b_open, c_open), 0);
    }
}

void phase_watch_begin(struct axis *a)
{
    a->supervision.phases = (struct phase_watch){.min_q15 = a->tuning.i_max_q15 >> MIN_SHIFT};
}

bool phase_watch_suspects(const struct axis *a, int32_t *phase)
{
    const struct phase_watch *const p = &a->supervision.phases;
    const bool running = a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
    const int32_t min_q15 = p->min_q15 * SUSPECT;
    const bool a_open = p->missing_q15[0] > min_q15;
    const bool b_open = p->missing_q15[1] > min_q15;
    const bool c_open = p->missing_q15[2] > min_q15;
    *phase = open_one(a_open, b_open, c_open);
    return running && !lock_watch_suspects(a) && (a_open || b_open || c_open);
}

/* ==== the sensors' zeros ==== */

#define LOOK_HZ     1000
#define TRAVEL_Q15  (4 * LOOK_HZ * 32768 / CONFIG_SPEED_BASE_HZ) /* four turns of the field, as a sum of w_q15 */
#define SAMPLES_MIN 256                                          /* samples: a quarter of a second */
#define SAMPLES_MAX 8192                                         /* a longer measurement is discarded */
#define ALLOWED_Q15 (32768 / 32)                                 /* 3 % of the range */
#define BEAT_HZ     8

void zero_watch_begin(struct zero_watch *z)
{
    *z = (struct zero_watch){0};
}

/* Aliasing: at multiples of the sampling rate the field shows the same angle each time. */
static bool is_aliased(int32_t w_q15)
{
    const int32_t hz = (q15_abs(w_q15) * CONFIG_SPEED_BASE_HZ) >> 15;
    return hz > LOOK_HZ / 2 && q15_abs((hz + LOOK_HZ / 2) % LOOK_HZ - LOOK_HZ / 2) < BEAT_HZ;
}

/* The mean over the angle: each sample is weighted by the field's signed travel. */
static void judge(const struct zero_watch *z, struct axis *a)
{
    const int32_t mean_q15 = (int32_t)(z->sum_q30 / z->travel_q15);
    if (q15_abs(mean_q15) > ALLOWED_Q15) {
        fault_report(a, FAULT_CURRENT_OFFSET, (int32_t)((int64_t)mean_q15 * a->params.i_range_ma / 32768), 0);
    }
}

void zero_watch_step(struct zero_watch *z, struct axis *a)
{
    const struct adc_regs *const adc = &a->fabric->adc;
    const struct adc_sample now = adc_read(adc);
    const int32_t w_q15 = current_loop_w_q15(&a->loop);
    if (!adc_sees_all(adc) || is_aliased(w_q15)) {
        return;
    }
    z->sum_q30 += (int64_t)(now.ia_q15 + now.ib_q15 + now.ic_q15) * w_q15;
    z->travel_q15 += w_q15;
    z->samples++;
    const bool turned = z->samples >= SAMPLES_MIN && q15_abs(z->travel_q15) >= TRAVEL_Q15;
    if (turned) {
        judge(z, a);
    }
    if (turned || z->samples >= SAMPLES_MAX) {
        zero_watch_begin(z);
    }
}
