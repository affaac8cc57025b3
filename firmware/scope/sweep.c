/* SPDX-License-Identifier: MIT */
#include "firmware/scope/sweep.h"

#include "drivers/cortex/cpu.h"
#include "firmware/settings/config.h"
#include "firmware/settings/scale.h"
#include "lib/polar.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define RATIO_Q15  37471 /* of a frequency to the previous one: 64 times in 31 steps */
#define FROM_SHARE 8u    /* lowest frequency: this part of the bandwidth */
#define WINDOW     25u   /* at least 1/25 s, and at least */
#define PERIODS    8u    /* periods */
#define SETTLING   2u    /* half a window of settling before it */
#define SMALL      (1LL << 30)

/* ---- the next frequency ---- */

static void start_point(struct sweep *s)
{
    const int64_t rate_mhz = s->rate_hz * 1000LL;
    const uint32_t shortest = s->rate_hz / WINDOW;
    const uint32_t lasting = (uint32_t)scale(rate_mhz, PERIODS, s->nominal_mhz);
    s->samples = lasting > shortest ? lasting : shortest;
    s->periods = (uint32_t)scale(s->nominal_mhz, s->samples, rate_mhz);
    s->step_q32 = (uint32_t)scale(s->periods, 1LL << 32, s->samples);
    s->settle = s->samples / SETTLING;
    s->probe = s->response = (struct sweep_complex){0, 0};
    cpu_compiler_barrier();
    s->left = s->samples;
}

static uint32_t bandwidth_hz(const struct sweep *s)
{
    const struct params *const p = &s->axis->params;
    return (uint32_t)(s->loop == SWEEP_SPEED ? p->speed_bw_hz : p->current_bw_hz);
}

/* ---- begin and end ---- */

static struct outcome check_sweep(const struct axis *a, enum sweep_loop loop, int32_t milliamp)
{
    const int32_t most = a->params.i_max_ma / SWEEP_SHARE;
    if (a->state != AXIS_OPERATION_ENABLED) {
        return outcome_of(ERROR_NOT_OPERATING);
    }
    if (loop == SWEEP_SPEED && axis_mode_is_torque(a->mode)) {
        return outcome_of(ERROR_SWEEP_MODE);
    }
    return milliamp < 1 || milliamp > most ? (struct outcome){ERROR_SWEEP_AMPLITUDE, most} : OUTCOME_OK;
}

struct outcome sweep_begin(struct sweep *s, enum sweep_loop loop, int32_t milliamp)
{
    struct axis *const a = s->axis;
    const struct outcome outcome = check_sweep(a, loop, milliamp);
    if (outcome.error == ERROR_NONE) {
        *s = (struct sweep){.axis = a, .loop = loop, .cos_q15 = Q15_ONE};
        s->amplitude_q15 = q15_max(tuning_q15_from_milli(milliamp, a->params.i_range_ma), 1);
        s->rate_hz = loop == SWEEP_SPEED ? CONFIG_SLOW_HZ : (uint32_t)a->loop.loops_per_slow * CONFIG_SLOW_HZ;
        s->nominal_mhz = bandwidth_hz(s) * 1000u / FROM_SHARE;
        start_point(s);
        cpu_compiler_barrier();
        s->state = SWEEP_RUNS;
    }
    return outcome;
}

static int32_t reference_q15(const struct sweep *s)
{
    const volatile struct current_loop *const c = &s->axis->loop;
    return s->loop == SWEEP_D ? c->i_d_ref_q15 : c->i_q_ref_q15;
}

static void set_reference(const struct sweep *s, int32_t value_q15)
{
    volatile struct current_loop *const c = &s->axis->loop;
    if (s->loop == SWEEP_D) {
        current_loop_set_i_d(c, value_q15);
    } else {
        current_loop_set_i_q(c, value_q15);
    }
}

/* Unless it has changed: a failover from the encoder may transform the references at any sample. */
static void replace_reference(const struct sweep *s, int32_t seen_q15, int32_t value_q15)
{
    const uint32_t mask = cpu_irq_save();
    if (reference_q15(s) == seen_q15) {
        set_reference(s, value_q15);
    }
    cpu_irq_restore(mask);
}

static void finish(struct sweep *s, enum sweep_state how)
{
    const uint32_t held = cpu_mask_below(CONFIG_PRIORITY_SLOW_LOOP); /* which also writes the reference */
    s->state = how;
    cpu_compiler_barrier();
    if (s->loop == SWEEP_SPEED) {
        s->axis->torque.probe_q15 = 0;
    } else {
        replace_reference(s, s->written_q15, s->base_q15);
    }
    (void)cpu_mask_below(held);
}

void sweep_end(struct sweep *s)
{
    if (sweep_runs(s)) {
        finish(s, SWEEP_ENDED);
    }
}

/* ---- a result ---- */

/* T = response / probe; both are scaled down for the products. */
static void take_point(struct sweep *s)
{
    struct sweep_complex a = s->response, p = s->probe;
    while (p.re > SMALL || p.re < -SMALL || p.im > SMALL || p.im < -SMALL || a.re > SMALL || a.re < -SMALL ||
           a.im > SMALL || a.im < -SMALL) {
        a = (struct sweep_complex){a.re / 2, a.im / 2};
        p = (struct sweep_complex){p.re / 2, p.im / 2};
    }
    const int64_t size = (p.re * p.re + p.im * p.im) / SWEEP_UNITY + 1;
    s->points[s->count] = (struct sweep_point){
        .millihertz = (int32_t)scale(s->periods, s->rate_hz * 1000LL, s->samples),
        .re_q14 = (int32_t)((a.re * p.re + a.im * p.im) / size),
        .im_q14 = (int32_t)((a.im * p.re - a.re * p.im) / size),
    };
    s->count++;
}

bool sweep_poll(struct sweep *s)
{
    if (!sweep_runs(s)) {
        return false;
    }
    if (s->axis->state != AXIS_OPERATION_ENABLED) {
        sweep_end(s);
        return true;
    }
    if (s->left > 0u) {
        return false;
    }
    take_point(s);
    s->nominal_mhz = (uint32_t)((uint64_t)s->nominal_mhz * RATIO_Q15 >> 15);
    if (s->count == SWEEP_POINTS || s->nominal_mhz > s->rate_hz * 10u * SWEEP_HIGH_PCT) {
        finish(s, SWEEP_DONE);
    } else {
        start_point(s);
    }
    return true;
}

/* ---- the interrupts' halves ---- */

static void sweep_add(struct sweep_complex *sum, int32_t value_q15, const struct sweep *s)
{
    sum->re += (int64_t)value_q15 * s->cos_q15;
    sum->im -= (int64_t)value_q15 * s->sin_q15;
}

/* Adds the present sample; returns the sine of the next one, `samples` later. */
static int32_t sweep_correlate(struct sweep *s, int32_t probe_q15, int32_t response_q15, uint32_t samples)
{
    if (s->settle > 0u) {
        s->settle--;
    } else if (s->left > 0u) {
        sweep_add(&s->probe, probe_q15, s);
        sweep_add(&s->response, response_q15, s);
        s->left--;
    }
    s->phase_q32 += s->step_q32 * samples;
    const cossin_t cs = cossin_q15(s->phase_q32);
    s->cos_q15 = cs.cos;
    s->sin_q15 = cs.sin;
    return (s->amplitude_q15 * cs.sin) >> 15;
}

void sweep_sample(struct sweep *s, uint32_t samples)
{
    const volatile struct current_loop *const c = &s->axis->loop;
    if (s->loop == SWEEP_SPEED || !current_loop_is_on(c)) {
        return;
    }
    const int32_t seen_q15 = reference_q15(s);
    const int32_t next_q15 = sweep_correlate(s, seen_q15, s->loop == SWEEP_D ? c->i_d_q15 : c->i_q_q15, samples);
    s->base_q15 = seen_q15 == s->written_q15 ? s->base_q15 : seen_q15;
    s->written_q15 = s->base_q15 + next_q15;
    replace_reference(s, seen_q15, s->written_q15);
}

void sweep_step(struct sweep *s)
{
    struct torque_control *const t = &s->axis->torque;
    if (sweep_runs(s) && s->loop == SWEEP_SPEED) {
        t->probe_q15 = sweep_correlate(s, t->probe_q15, t->probe_q15 - t->torque_q15, 1u);
    }
}

/* ---- characteristic frequencies ---- */

/* Where a value falls through 0 between two points, as a fraction, Q15; -1: it does not. */
static int32_t crossing_q15(int64_t before, int64_t after)
{
    return before > 0 && after <= 0 ? (int32_t)scale(before, 32768, before - after) : -1;
}

static int32_t sweep_between(int32_t a, int32_t b, int32_t share_q15)
{
    return a + (int32_t)(((int64_t)(b - a) * share_q15) >> 15);
}

/* Each is where reading_of() falls through 0. */
enum reading { CROSSOVER, LAG, BANDWIDTH };

static int64_t reading_of(const struct sweep_point *p, enum reading what)
{
    switch (what) {
    case CROSSOVER:
        return p->re_q14 - SWEEP_UNITY / 2;
    case LAG:
        return p->re_q14;
    default:
        return (int64_t)p->re_q14 * p->re_q14 + (int64_t)p->im_q14 * p->im_q14 - (int64_t)SWEEP_UNITY * SWEEP_UNITY / 2;
    }
}

/* The first point after it, and the fraction between; 0: none. */
static uint32_t find(const struct sweep *s, enum reading what, int32_t *share_q15)
{
    for (uint32_t n = 1; n < s->count; n++) {
        *share_q15 = crossing_q15(reading_of(&s->points[n - 1u], what), reading_of(&s->points[n], what));
        if (*share_q15 >= 0) {
            return n;
        }
    }
    return 0;
}

static int32_t frequency_mhz(const struct sweep *s, enum reading what)
{
    int32_t share_q15;
    const uint32_t n = find(s, what, &share_q15);
    return n == 0u ? 0 : sweep_between(s->points[n - 1u].millihertz, s->points[n].millihertz, share_q15);
}

static int32_t margin_ddeg(const struct sweep *s)
{
    int32_t share_q15;
    const uint32_t n = find(s, CROSSOVER, &share_q15);
    if (n == 0u) {
        return 0;
    }
    const int32_t im_q14 = sweep_between(s->points[n - 1u].im_q14, s->points[n].im_q14, share_q15);
    const int32_t angle_q32 = (int32_t)atan2_q32(-2 * im_q14, SWEEP_UNITY);
    return 1800 - (int32_t)(((int64_t)angle_q32 * 7200) >> 32);
}

struct sweep_summary sweep_summary(const struct sweep *s)
{
    return (struct sweep_summary){
        .crossover_mhz = frequency_mhz(s, CROSSOVER),
        .margin_ddeg = margin_ddeg(s),
        .lag_mhz = frequency_mhz(s, LAG),
        .bandwidth_mhz = frequency_mhz(s, BANDWIDTH),
    };
}
