/* SPDX-License-Identifier: MIT */
/*
 * The instances of the interrupt for field weakening, against the same said in full: 64-bit sums, comparisons and
 * a root by halving in place of masks, saturating instructions and tables. What both share other tests hold: sensing,
 * the angle, the sine, and within the circle the modulator. Besides: no voltage leaves its circle, and no compare its place,
 * which beyond the modulator's circle is an end of the period or a pulse that need not be stretched.
 */
#include "firmware/control/current_loop_step.h"

#include "drivers/mss/watchdog.h"
#include "tests/target/harness.h"
#include "tests/target/random.h"

#define STEPS 10000u

static uint32_t random_state = RANDOM_SEED;

static uint32_t next(void)
{
    return random_next(&random_state);
}

static int32_t any(int32_t limit)
{
    return random_any(&random_state, limit);
}

static void fill(struct current_loop *c, struct fabric *f, int32_t radius_steps)
{
    *c = (struct current_loop){.sine = trig_chords, .status_max = 1u};
    c->pll.angle_q32 = next();
    c->pll.speed_q32 = any(1 << 28);
    c->angle_offset_q32 = next();
    c->i_d_ref_q15 = any(32767);
    c->i_q_ref_q15 = any(32767);
    c->kp_d_q9 = (int32_t)(next() % 1024u);
    c->kp_q_q9 = (int32_t)(next() % 1024u);
    c->ki_q15 = (int32_t)(next() % 4096u);
    c->integral_d_q9 = any(1 << 24);
    c->integral_q_q9 = any(1 << 24);
    c->turn_q15 = any(ADVANCE_MAX_Q15);
    c->encoder_scale_q32 = next();
    c->dead_shift = next() % 6u;
    c->weaken = (struct loop_weakening){
        .turn_q32 = next(),
        .radius_steps = radius_steps,
        .q_first = (next() & 1u) != 0u ? -1 : 0,
        .first_max_steps = radius_steps - any(radius_steps / 2) / 2 - radius_steps / 4,
        .gain_share_q8 = (int32_t)(next() % 257u),
        .gain_q15 = any(WEAKEN_GAIN_MAX_Q15),
        .most_q15 = (int32_t)(next() % 32768u),
        .room_q_steps = (int32_t)(next() % 32768u),
    };
    c->weaken.retreat_q22 = (int32_t)(next() % 32768u) << WEAKEN_RETREAT_SHIFT;
    uint32_t *const words = (uint32_t *)f;
    words[offsetof(struct fabric, adc.IA) / 4u] = (uint32_t)any(32767);
    words[offsetof(struct fabric, adc.IB) / 4u] = (uint32_t)any(32767);
    words[offsetof(struct fabric, adc.IC) / 4u] = (uint32_t)any(32767);
    words[offsetof(struct fabric, encoder.LATCHED) / 4u] = next() % 65536u;
    f->gate.STATUS = (next() & 3u) == 0u ? 2u : 1u;
}

/* ---- said plainly ---- */

static int32_t root_down(int64_t square)
{
    int32_t root = 0;
    for (int32_t bit = 1 << 15; bit > 0; bit /= 2) {
        root += (int64_t)(root + bit) * (root + bit) <= square ? bit : 0;
    }
    return root;
}

struct axis_plain {
    int32_t wanted, got;
    int64_t integral;
};

static struct axis_plain wish(int32_t kp_q9, int32_t error, int32_t integral_q9)
{
    const int64_t wanted = ((int64_t)kp_q9 * error + integral_q9) >> 9;
    const int32_t limited = wanted > 32767 ? 32767 : (wanted < -32768 ? -32768 : (int32_t)wanted);
    return (struct axis_plain){limited, limited, integral_q9};
}

static void limit(struct axis_plain *a, int32_t most, int32_t ki_q15, int32_t error)
{
    a->got = a->wanted > most ? most : (a->wanted < -most ? -most : a->wanted);
    int32_t step = ki_q15 * error;
    if ((a->wanted > most && step > 0) || (a->wanted < -most && step < 0)) {
        step = 0;
    }
    a->integral += step >> PI_STEP_SHIFT;
}

static dq_t plain(struct current_loop *c, dq_t i)
{
    struct loop_weakening *const w = &c->weaken;
    const int32_t error_d =
        ((c->i_d_ref_q15 - w->retreat_q22 / (1 << WEAKEN_RETREAT_SHIFT) - i.d) * w->gain_share_q8) >> 8;
    const int32_t error_q = ((c->i_q_ref_q15 - i.q) * w->gain_share_q8) >> 8;
    struct axis_plain d = wish(c->kp_d_q9, error_d, c->integral_d_q9);
    struct axis_plain q = wish(c->kp_q_q9, error_q, c->integral_q_q9);
    if (w->q_first != 0) {
        limit(&q, w->first_max_steps, c->ki_q15, error_q);
        limit(&d, root_down((int64_t)w->radius_steps * w->radius_steps - (int64_t)q.got * q.got), c->ki_q15, error_d);
    } else {
        limit(&d, w->first_max_steps, c->ki_q15, error_d);
        limit(&q, root_down((int64_t)w->radius_steps * w->radius_steps - (int64_t)d.got * d.got), c->ki_q15, error_q);
    }
    int32_t over = w->gain_q15 < 0 ? ~(q.wanted - q.got) : q.wanted - q.got;
    const int32_t beyond = (w->gain_q15 < 0 ? ~q.wanted : q.wanted) - w->room_q_steps;
    over = over < beyond ? over : beyond;
    over = over > WEAKEN_DEAD_STEPS ? over - WEAKEN_DEAD_STEPS : 0;
    const int32_t gain_q15 = w->gain_q15 < 0 ? -w->gain_q15 : w->gain_q15;
    const int32_t wanted_q22 = (int32_t)(((int64_t)over * gain_q15) >> 8);
    const int32_t next_q22 = w->retreat_q22 + ((wanted_q22 - w->retreat_q22) >> 2);
    const int32_t most_q22 = w->most_q15 * 128;
    w->retreat_q22 = next_q22 > most_q22 ? most_q22 : next_q22;
    c->i_d_q15 = i.d;
    c->i_q_q15 = i.q;
    c->integral_d_q9 = (int32_t)d.integral;
    c->integral_q_q9 = (int32_t)q.integral;
    c->v_d_steps = d.got;
    c->v_q_steps = q.got;
    return (dq_t){d.got, q.got};
}

static bool plain_step(struct current_loop *c, struct fabric *f)
{
    const alphabeta_t i = sense(f);
    const alphabeta_t coarse = {i.alpha >> c->dead_shift, i.beta >> c->dead_shift};
    const uint32_t angle_q32 = angle_of_rotor(c);
    const dq_t v = plain(c, park_q15(i, cossin_q15(angle_q32)));
    modulate(&f->pwm, v, cossin_q15(angle_q32 + c->weaken.turn_q32), coarse, c->turn_q15);
    angle_observe(c, f->encoder.LATCHED);
    f->adc.STATUS = ADC_STATUS_EOC;
    return f->gate.STATUS > c->status_max;
}

/* ---- compared ---- */

static _Alignas(512) struct current_loop tested_loop;
static struct current_loop expected_loop;
static _Alignas(512) struct fabric tested_fabric;
static struct fabric expected_fabric;

static void copy(struct fabric *to, const struct fabric *from)
{
    const volatile uint32_t *const a = (const volatile uint32_t *)from;
    volatile uint32_t *const b = (volatile uint32_t *)to;
    for (uint32_t n = 0; n < sizeof *to / 4u; n++) {
        b[n] = a[n];
    }
}

static bool same_state(void)
{
    const uint32_t *const a = (const uint32_t *)&tested_loop;
    const uint32_t *const b = (const uint32_t *)&expected_loop;
    uint32_t different = 0;
    for (uint32_t n = 0; n < sizeof tested_loop / 4u; n++) {
        different += a[n] != b[n] ? 1u : 0u;
    }
    return different == 0u;
}

static bool same_compares(void)
{
    const struct pwm_regs *const a = &tested_fabric.pwm;
    const struct pwm_regs *const b = &expected_fabric.pwm;
    return a->COMPARE_A == b->COMPARE_A && a->COMPARE_B == b->COMPARE_B && a->COMPARE_C == b->COMPARE_C;
}

static bool in_place(uint32_t compare, bool beyond)
{
    const uint32_t taken = CONFIG_DEAD_COUNTS + CONFIG_MIN_PULSE_COUNTS;
    const bool within = beyond ? compare >= OVERMODULATE_EDGE && compare <= CONFIG_HALF_COUNTS - OVERMODULATE_EDGE
                               : 2u * compare >= taken && 2u * (CONFIG_HALF_COUNTS - compare) >= taken;
    return (compare <= CONFIG_HALF_COUNTS && within) || (beyond && (compare == 0u || compare == CONFIG_HALF_COUNTS));
}

static bool all_in_place(bool beyond)
{
    const struct pwm_regs *const pwm = &tested_fabric.pwm;
    return in_place(pwm->COMPARE_A, beyond) && in_place(pwm->COMPARE_B, beyond) && in_place(pwm->COMPARE_C, beyond);
}

static bool in_circle(const struct current_loop *c)
{
    const int64_t square = (int64_t)c->v_d_steps * c->v_d_steps + (int64_t)c->v_q_steps * c->v_q_steps;
    return square <= (int64_t)c->weaken.radius_steps * c->weaken.radius_steps;
}

struct wrong {
    uint32_t state, compares, places, circle, faults;
};

/* One of the two, as a constant: then it is the very code of its handler. */
static inline __attribute__((always_inline)) void test(const char *title, bool beyond)
{
    struct wrong wrong = {0};
    for (uint32_t step = 0; step < STEPS; step++) {
        const int32_t percent = beyond ? (int32_t)(next() % 101u) : 0;
        fill(&tested_loop, &tested_fabric,
             CONFIG_RADIUS_STEPS + (CONFIG_SIX_STEPS - CONFIG_RADIUS_STEPS) * percent / 100);
        expected_loop = tested_loop;
        copy(&expected_fabric, &tested_fabric);
        const bool fault = current_loop_step_weakening(&tested_loop, &tested_fabric, beyond);
        wrong.faults += fault == plain_step(&expected_loop, &expected_fabric) ? 0u : 1u;
        wrong.state += same_state() ? 0u : 1u;
        wrong.compares += beyond || same_compares() ? 0u : 1u; /* beyond: tests/unit/test_overmodulation.py */
        wrong.places += all_in_place(beyond) ? 0u : 1u;
        wrong.circle += in_circle(&tested_loop) ? 0u : 1u;
        watchdog_refresh();
    }
    harness_note(title, STEPS);
    harness_equal("states that differ", wrong.state, 0u);
    harness_equal("compares that differ", wrong.compares, 0u);
    harness_equal("compares out of place", wrong.places, 0u);
    harness_equal("voltages beyond their circle", wrong.circle, 0u);
    harness_equal("faults missed or made up", wrong.faults, 0u);
}

int main(void)
{
    harness_begin();
    test("weakening: steps", false);
    test("overmodulating: steps", true);
    harness_end();
}
