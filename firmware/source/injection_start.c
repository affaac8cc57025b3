/* SPDX-License-Identifier: MIT */
#include "firmware/source/injection_start.h"

#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/source/rotor.h"
#include "lib/angle.h"
#include "lib/polar.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define SWEEP_ANGLES  8u
#define SWEEP_STEP    (0x80000000u / SWEEP_ANGLES)
#define SWEEP_SETTLES 3u
#define SWEEP_MS      7u

#define LOCK_MS 40u

/* Current signs +, -, -, +, so that drift cancels. */
#define POLARITY_PARTS   4u
#define POLARITY_SETTLES 12u
#define POLARITY_MS      24u
#define POLARITY_TRIES   3u
#define SIGMAS_SQUARED   36
#define MIN_PART         64 /* of the responses: a smaller one may be an artefact */

#define PUSH_FIRST_MS 1u
#define PUSH_LAST_MS  256u
#define PUSH_SETTLES  24u
/* 24 degrees, twice the difference of both directions; the tracked angle is accurate to 2 */
#define PUSH_MIN_Q32  ((1LL << 32) / 15)
#define PUSH_SEARCHES 16u

#define PUSH_FAR_Q32  0x20000000u /* 45 degrees: the next push would be four times as far */
#define PUSH_VOID_Q32 0x60000000u /* 135 degrees: beyond half a turn the result would be ambiguous */

/* 4 LSB per degree: 229 per radian. */
#define RADIAN_MIN 230

#define DEGREE_OF_RADIAN_Q16 1144 /* 1 / 57.296 */

enum start_step {
    STEP_SWEEP,
    STEP_LOCK,
    STEP_POLARITY,
    STEP_REST, /* ramps the test current down */
    STEP_PUSH,
};

bool injection_wanted(const struct axis *a)
{
    return rotor_is_sensorless(a) && a->tuning.injection.v_q15 != 0;
}

void injection_begin(struct axis *a)
{
    a->injection = (struct injection_start){.step = STEP_SWEEP};
    a->sensorless = (struct sensorless){0};
    current_loop_field(&a->loop, 0, 0);
}

bool injection_brakes(const struct axis *a)
{
    return a->injection.step == STEP_LOCK;
}

static void next_step(struct injection_start *s, enum start_step step)
{
    s->step = step;
    s->ms = 0;
}

/* ---- sweep ---- */

/* Adds this angle's mean responses to the sums. */
static void add_angle(struct axis *a)
{
    struct injection_start *const s = &a->injection;
    const struct injection_response sum = injection_take(&a->loop);
    const int32_t samples = (int32_t)(SWEEP_MS - SWEEP_SETTLES) * a->tuning.loops_per_slow;
    const int32_t d = q15_sat16(sum.d / samples);
    const int32_t q = q15_sat16(sum.q / samples);
    const cossin_t twice = cossin_q15(2u * s->angle * SWEEP_STEP);
    s->sum_re += (d * twice.cos - q * twice.sin) >> 15;
    s->sum_im += (d * twice.sin + q * twice.cos) >> 15;
    s->sum_straight += d;
}

/* No voltage except the injected one: shorted windings brake. */
static void short_windings(volatile struct current_loop *c)
{
    current_loop_drop_voltage(c);
}

static enum injection_result leave_sweep(struct axis *a)
{
    struct injection_start *const s = &a->injection;
    const int32_t re = q15_sat16(s->sum_re / 2);
    const int32_t im = q15_sat16(s->sum_im / 2);
    s->straight = s->sum_straight / (int32_t)SWEEP_ANGLES;
    s->radian = magnitude_q15(re, im) * 4 / (int32_t)SWEEP_ANGLES;
    s->detail_q8 = (q15_min(s->radian, INT16_MAX) * DEGREE_OF_RADIAN_Q16) >> 8;
    if (s->radian < RADIAN_MIN) {
        return INJECTION_SALIENCY;
    }
    injection_track(&a->loop, &a->tuning, atan2_q32(im, re) / 2u, s->radian);
    current_loop_follow_rotor(&a->loop);
    short_windings(&a->loop);
    next_step(s, STEP_LOCK);
    return INJECTION_RUNNING;
}

static enum injection_result sweep(struct axis *a)
{
    struct injection_start *const s = &a->injection;
    s->ms++;
    if (s->ms == SWEEP_SETTLES) {
        (void)injection_take(&a->loop);
    }
    if (s->ms < SWEEP_MS) {
        return INJECTION_RUNNING;
    }
    add_angle(a);
    s->angle++;
    s->ms = 0;
    if (s->angle == SWEEP_ANGLES) {
        return leave_sweep(a);
    }
    current_loop_field(&a->loop, s->angle * SWEEP_STEP, 0);
    return INJECTION_RUNNING;
}

/* ---- polarity ---- */

static void begin_polarity(struct axis *a, int32_t i_q15)
{
    struct injection_start *const s = &a->injection;
    next_step(s, STEP_POLARITY);
    s->i_q15 = i_q15;
    s->with = s->against = 0;
    s->with_squares = s->against_squares = 0;
}

/* Turns the frame by half a turn: all quantities change sign. */
static void injection_turn_round(volatile struct current_loop *c)
{
    const uint32_t mask = cpu_irq_save();
    current_loop_correct(c, 0x80000000u, 0);
    current_loop_hold(c, -c->integral_d_q9, -c->integral_q_q9);
    cpu_irq_restore(mask);
}

/* Sum of squares about the mean, of `count` values. */
static int64_t scatter(int64_t squares, int64_t sum, int64_t count)
{
    return squares - sum * sum / count;
}

/*
 * The difference of two sums of n values each has the variance 2 n s^2, where s^2 is the scatter of both over 2 n - 2: so the
 * difference squared over both scatters gives the number of sigmas squared.
 */
static bool injection_differ(const struct injection_start *s)
{
    const int64_t count = (int64_t)(POLARITY_MS - POLARITY_SETTLES) * (POLARITY_PARTS / 2u);
    const int64_t difference = (int64_t)s->with - s->against;
    const int64_t both = scatter(s->with_squares, s->with, count) + scatter(s->against_squares, s->against, count);
    const int64_t least = ((int64_t)s->with + s->against) / MIN_PART;
    return difference * difference > SIGMAS_SQUARED * both && (difference < 0 ? -difference : difference) > least;
}

static enum injection_result leave_polarity(struct axis *a)
{
    struct injection_start *const s = &a->injection;
    s->tries++;
    s->polarity_found = injection_differ(s);
    if (!s->polarity_found && s->tries < POLARITY_TRIES) {
        begin_polarity(a, q15_min(s->i_q15 + s->i_q15 / 2, a->tuning.i_max_q15));
        return INJECTION_RUNNING;
    }
    if (s->polarity_found && s->with < s->against) {
        injection_turn_round(&a->loop);
    }
    current_loop_set_i_d(&a->loop, 0);
    next_step(s, STEP_REST);
    return INJECTION_RUNNING;
}

static enum injection_result decide_polarity(struct axis *a)
{
    struct injection_start *const s = &a->injection;
    const uint32_t part = s->ms / POLARITY_MS;
    if (part == POLARITY_PARTS) {
        return leave_polarity(a);
    }
    const bool with = part == 0u || part == POLARITY_PARTS - 1u;
    const int64_t seen = injection_take(&a->loop).d;
    if (s->ms % POLARITY_MS >= POLARITY_SETTLES) {
        *(with ? &s->with : &s->against) += (int32_t)seen;
        *(with ? &s->with_squares : &s->against_squares) += seen * seen;
    }
    current_loop_set_i_d(&a->loop, with ? s->i_q15 : -s->i_q15);
    s->ms++;
    return INJECTION_RUNNING;
}

/* ---- push ---- */

static void begin_push(struct axis *a, uint32_t push_ms)
{
    struct injection_start *const s = &a->injection;
    next_step(s, STEP_PUSH);
    s->push_ms = push_ms;
    s->push_from_q32 = a->loop.pll.angle_q32;
}

/*
 * Twice the angle between both directions, from the windows before and after the middle one: drift or a constant load cancels.
 */
static int64_t pushed_apart_q32(const struct injection_start *s)
{
    return (int64_t)s->pushed_q32[0] - 2LL * s->pushed_q32[1] + s->pushed_q32[2];
}

static uint32_t pushed_max_q32(const struct injection_start *s)
{
    uint32_t max_q32 = 0;
    for (uint32_t n = 0; n < PUSH_WINDOWS; n++) {
        const uint32_t size_q32 = angle_size_q32(s->pushed_q32[n]);
        max_q32 = size_q32 > max_q32 ? size_q32 : max_q32;
    }
    return max_q32;
}

/* Direction of motion: 1 forward, -1 backward, 0 unknown. */
static int32_t pushed_direction(const struct injection_start *s)
{
    const int64_t apart_q32 = pushed_apart_q32(s);
    if (pushed_max_q32(s) > PUSH_VOID_Q32) {
        return 0;
    }
    return apart_q32 >= PUSH_MIN_Q32 ? 1 : (apart_q32 <= -PUSH_MIN_Q32 ? -1 : 0);
}

/* Doubles the push, unless it gave a result or a longer one might turn the rotor by half a turn. */
static uint32_t next_push_ms(const struct injection_start *s, int32_t direction)
{
    const uint32_t max_q32 = pushed_max_q32(s);
    if (max_q32 > PUSH_VOID_Q32) {
        return s->push_ms > PUSH_FIRST_MS ? s->push_ms / 2u : PUSH_FIRST_MS;
    }
    return direction != 0 || max_q32 > PUSH_FAR_Q32 ? s->push_ms : 2u * s->push_ms;
}

/* Two pushes in a row must agree, because a load that changes during one can give any result. */
static enum injection_result leave_push(struct axis *a)
{
    struct injection_start *const s = &a->injection;
    const int32_t direction = pushed_direction(s);
    const uint32_t next_ms = next_push_ms(s, direction);
    s->searches++;
    if (direction != 0 && direction == s->direction) {
        if (direction < 0) {
            injection_turn_round(&a->loop);
        }
        return INJECTION_DONE;
    }
    if (next_ms > PUSH_LAST_MS || s->searches == PUSH_SEARCHES) {
        return INJECTION_POLARITY;
    }
    s->direction = direction != 0 ? direction : s->direction;
    begin_push(a, next_ms);
    return INJECTION_RUNNING;
}

static enum injection_result push_north(struct axis *a)
{
    struct injection_start *const s = &a->injection;
    const uint32_t window_ms = 2u * s->push_ms + PUSH_SETTLES;
    const uint32_t window = s->ms / window_ms;
    const uint32_t ms = s->ms % window_ms;
    if (s->ms != 0u && ms == 0u) {
        s->pushed_q32[window - 1u] = (int32_t)(a->loop.pll.angle_q32 - s->push_from_q32);
        s->push_from_q32 = a->loop.pll.angle_q32;
    }
    (void)injection_take(&a->loop);
    if (window == PUSH_WINDOWS) {
        return leave_push(a);
    }
    const int32_t i_q15 =
        (ms < s->push_ms) == (window != 1u) ? a->tuning.i_max_q15 / 3 * 2 : -a->tuning.i_max_q15 / 3 * 2;
    current_loop_set_i_q(&a->loop, ms < 2u * s->push_ms ? i_q15 : 0);
    s->ms++;
    return INJECTION_RUNNING;
}

/* ---- sequence ---- */

static enum injection_result rest(struct axis *a)
{
    struct injection_start *const s = &a->injection;
    s->ms++;
    (void)injection_take(&a->loop);
    if (s->ms < POLARITY_SETTLES) {
        return INJECTION_RUNNING;
    }
    if (s->polarity_found) {
        return INJECTION_DONE;
    }
    begin_push(a, PUSH_FIRST_MS);
    return INJECTION_RUNNING;
}

static enum injection_result lock(struct axis *a)
{
    a->injection.ms++;
    if (a->injection.ms == LOCK_MS && a->tuning.reluctant) {
        begin_push(a, PUSH_FIRST_MS);
    } else if (a->injection.ms == LOCK_MS) {
        begin_polarity(a, a->tuning.injection.polarity_q15);
    }
    return INJECTION_RUNNING;
}

static enum injection_result step(struct axis *a)
{
    switch (a->injection.step) {
    case STEP_SWEEP:
        return sweep(a);
    case STEP_LOCK:
        return lock(a);
    case STEP_POLARITY:
        return decide_polarity(a);
    case STEP_REST:
        return rest(a);
    case STEP_PUSH:
    default:
        return push_north(a);
    }
}

enum injection_result injection_start_step(struct axis *a)
{
    const enum injection_result result = step(a);
    a->injection.result = result;
    return result;
}
