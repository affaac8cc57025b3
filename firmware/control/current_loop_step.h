/* SPDX-License-Identifier: MIT */
/*
 * One sample of the current loop in C, in four stages: sense -> angle -> regulate -> modulate. Each angle source is its own
 * instance: it is constant at the call, so the compiler keeps one path without branches, in constant time. current_loop_isr.S
 * is the hand-written instance for the encoder; tests require identical results.
 *
 * The conversion is acknowledged after its last value is read and before GATE.STATUS is read: a handler that returned before
 * its interrupt line dropped would run twice for one sample, unnoticed. Fabric accesses stay in order, so once that read
 * returns, the line is low.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_STEP_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_STEP_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop.h"
#include "firmware/control/hall.h"
#include "firmware/control/stage_weaken.h"
#include "firmware/settings/rates.h"
#include "lib/advance.h"
#include "lib/deadtime.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/pll.h"
#include "lib/q15.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

/* ==== overmodulation ==== */

/*
 * Voltages beyond the circle, up to six-step.
 *
 * Beyond vbus / sqrt(3) a phase would need more than the bus, so it saturates for part of the turn: the modulator clips the
 * excess. The remaining fundamental is smaller than asked for, by a known factor:
 *     length   1 / sqrt(3)   0.6     0.667   0.8     1       2          of vbus
 *     of six-step's, 2 / pi   0.907   0.930   0.957   0.970   0.981   0.995
 * So a vector is lengthened by the inverse before clipping, and the motor gets the fundamental the controllers asked for: their
 * gains hold, published voltages are real, and to current control and field weakening it is just a larger circle. The
 * transition is smooth: length and fundamental diverge without a step. The sixth harmonics from clipping appear in the currents
 * and remain. Clipping the duties is the shortest way from a vector to the hexagon (minimum-magnitude error); the inverse of
 * its gain: Hava, Kerkman, Lipo, "Carrier-based PWM-VSI overmodulation strategies", IEEE Trans. Power Electron. 13(4), 1998.
 */

/* The squared lengths between which a vector is lengthened: vbus / sqrt(3) and six-step's. */
#define OVERMODULATION_FROM    ((int32_t)((int64_t)CONFIG_BUS_STEPS * CONFIG_BUS_STEPS / 3))
#define OVERMODULATION_SQUARES ((int32_t)((int64_t)CONFIG_BUS_STEPS * CONFIG_BUS_STEPS * 4716 / 65536))

#define OVERMODULATION_BITS      5 /* of the table's index */
#define OVERMODULATION_GAIN_BITS 12

/*
 * The lengthening factor at equal steps of the vector's square: Q12, 1.0 to 3.15. The longest is twice the bus.
 * tests/unit/test_overmodulation.py recalculates them, by the Fourier integral of clipped duties.
 */
static const uint16_t overmodulation_gain_q12[(1 << OVERMODULATION_BITS) + 1] = {
    4096, 4098, 4101, 4106, 4113, 4121, 4130, 4142, 4155, 4170, 4189, 4210, 4235, 4265,  4302,  4349,  4414,
    4524, 4665, 4824, 5003, 5206, 5441, 5715, 6040, 6435, 6926, 7561, 8425, 9695, 11834, 12904, 12868,
};

/* ==== currents ==== */

/*
 * First stage of the current loop: two measured phase currents to a vector, Q15 of the sensors' range. ISR, constant time.
 *
 * The ADC block saturates to +-32767, so any two currents make a vector of length <= 65534 (lib/transform_q15.h).
 */

/* a and b; what a shunt cannot see the ADC block has replaced (adc_select()). 5 cycles, and the two reads. */
static inline alphabeta_t sense(const struct fabric *f)
{
    const int32_t a_q15 = f->adc.IA;
    const int32_t b_q15 = f->adc.IB;
    return clarke_q15(a_q15, b_q15);
}

/* ==== the angle, by encoder ==== */

/*
 * Second stage of the current loop: the field's electrical angle at the sample, and what keeps it up to date. ISR, constant
 * time.
 */

/* The encoder's, as the observer predicted it. */
static inline uint32_t angle_of_rotor(const struct current_loop *c)
{
    return c->pll.angle_q32 + c->angle_offset_q32;
}

/* Prescribed by the slow loop, regardless of the rotor; it turns by itself until the next sample. */
static inline uint32_t angle_of_field(struct current_loop *c)
{
    const uint32_t angle_q32 = c->field_angle_q32;
    c->field_angle_q32 = angle_q32 + (uint32_t)c->field_speed_q32;
    return angle_q32;
}

/* The flux observer's angle, or the prescribed one while it finds the rotor: a mask selects. */
static inline uint32_t angle_observed(struct current_loop *c)
{
    return angle_of_field(c) + (c->pll.angle_q32 & c->field_follows);
}

/* The tracking observer's step, whatever the field's source: the rotor's speed and angle are always known. */
static inline void angle_observe(struct current_loop *c, uint32_t encoder_counts)
{
    pll_track(&c->pll, encoder_counts * c->encoder_scale_q32, CONFIG_PLL_KP_SHIFT, CONFIG_PLL_KI_SHIFT);
}

/* ==== the angle, by Hall switches ==== */

/*
 * Runs after the current loop's four stages with Hall switches (hall.h): reads the state and its edge's time, latched with the
 * sample, and predicts the angle at the next sample. ISR, constant time: what does not apply is masked.
 */

/* Shifts to a share of a sample in Q15, and to a speed it may be multiplied by. */
#define HALL_SHARE_SHIFT 13
#define HALL_SPEED_SHIFT 15

/* The angle at the sample, if an edge came since the one before: beyond the edge by speed times its age. */
static inline uint32_t hall_beyond_edge(const struct hall *h, uint32_t edge_q32, uint32_t age_clocks, int32_t speed_q32)
{
    const uint32_t share_q15 = (age_clocks * h->clock_share_q28) >> HALL_SHARE_SHIFT;
    return edge_q32 + (uint32_t)(speed_q32 >> HALL_SPEED_SHIFT) * share_q15;
}

/* If none did: as predicted, but within the sector. */
static inline uint32_t hall_within(const struct hall_sector *s, uint32_t angle_q32)
{
    const int32_t off_q32 = (int32_t)(angle_q32 - s->middle_q32);
    return s->middle_q32 + (uint32_t)q15_clamp(off_q32, -s->half_q32, s->half_q32);
}

/* The speed is the slow loop's. */
static inline __attribute__((always_inline)) void hall_observe(struct current_loop *c, struct hall *h,
                                                               const struct encoder_regs *e)
{
    const uint32_t clock = encoder_hall_clock(e);
    const uint32_t age_clocks = encoder_latch_clock(e) - clock;
    const struct hall_move move = h->move[h->state][encoder_hall_latched(e)];
    const struct hall_sector *const s = &h->sector[move.next];
    const int32_t speed_q32 = c->pll.speed_q32;
    const uint32_t edge_q32 = s->middle_q32 - (uint32_t)(move.step * s->half_q32);
    const uint32_t crossed_q32 = hall_beyond_edge(h, edge_q32, age_clocks, speed_q32);
    const uint32_t within_q32 = hall_within(s, c->pll.angle_q32);
    const uint32_t crossed = 0u - ((uint32_t)move.step & 1u);
    const uint32_t count = h->count + (uint32_t)(int32_t)move.step;
    c->pll.angle_q32 = (within_q32 ^ ((within_q32 ^ crossed_q32) & crossed)) + (uint32_t)speed_q32;
    h->clock[count % HALL_EDGES_STORED] = clock;
    h->count = count;
    h->state = move.next;
    h->invalid += move.invalid;
    h->skipped += move.skipped;
}

/* ==== the angle, by the flux observer ==== */

/*
 * Runs after the current loop's four stages without an encoder: a step of the flux observer (observer.h), whose angle and speed
 * replace the encoder's. ISR, constant time.
 *
 * Ranges that exclude overflow: |i| <= 65534, |v| < 2^15, the flux within OBSERVER_FLUX_BITS; of_newest + of_older <= 2^14,
 * r_q5 <= 2^15, lq and |saliency| <= 2^14, |along| <= OBSERVER_ALONG_MAX, |back| < 2^15 with a shift of 3 at least, track <=
 * OBSERVER_TRACK_MAX. settings/tuning_start.c and observer.c ensure this; both are tested at their limits.
 */

#define FLUX_ERROR_SHIFT 10 /* from along times e, Q25, to Q15 */

/* Clamps to OBSERVER_FLUX_BITS. */
static inline int32_t flux_held(int32_t flux)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE)
    int32_t held;
    __asm__("ssat %0, %1, %2" : "=r"(held) : "I"(OBSERVER_FLUX_BITS), "r"(flux));
    return held;
#else
    return q15_clamp(flux, -(1 << (OBSERVER_FLUX_BITS - 1)), (1 << (OBSERVER_FLUX_BITS - 1)) - 1);
#endif
}

/* The rotor's angle and speed for the next sample: prediction less its lead according to the flux. */
static inline void flux_track(struct current_loop *c, int32_t nu_q15)
{
    c->pll.speed_q32 = (int32_t)((uint32_t)c->pll.speed_q32 - (uint32_t)((c->flux.track_speed_q8 * nu_q15) >> 8));
    c->pll.angle_q32 += (uint32_t)c->pll.speed_q32 - (uint32_t)(c->flux.track * nu_q15);
}

/* One axis's flux for the next sample, before feedback: realised voltage less R i, integrated. */
static inline __attribute__((always_inline)) int32_t flux_integrated(const struct observer *o, int32_t flux, int32_t v,
                                                                     int32_t v_before, int32_t i)
{
    return flux + o->of_newest * v + o->of_older * v_before - ((o->r_q5 * i) >> 5);
}

/*
 * `i` of the sample, `v` its output, in steps. The flux less L_q i is the active flux, which lies along d:
 * e = psi_f + (L_d - L_q) i_d - (psi - L_q i).
 *
 * Integration comes first, and barriers keep the order: this frees the voltages' registers for sine and cosine. Otherwise the
 * compiler loads early and spills: 11 cycles.
 */
static inline __attribute__((always_inline)) void flux_observe(struct current_loop *c, alphabeta_t i, alphabeta_t v)
{
    struct observer *const o = &c->flux;
    cpu_compiler_barrier();
    const int32_t next_alpha = flux_integrated(o, o->flux_alpha, v.alpha, o->v_alpha_steps, i.alpha);
    const int32_t next_beta = flux_integrated(o, o->flux_beta, v.beta, o->v_beta_steps, i.beta);
    o->v_alpha_steps = v.alpha;
    o->v_beta_steps = v.beta;
    const int32_t alpha = (o->flux_alpha >> OBSERVER_FLUX_SHIFT) - ((o->lq * i.alpha) >> 15);
    const int32_t beta = (o->flux_beta >> OBSERVER_FLUX_SHIFT) - ((o->lq * i.beta) >> 15);
    cpu_compiler_barrier();
    const cossin_t cs = cossin_q15(c->pll.angle_q32);
    const int32_t i_d_q15 = (i.alpha * cs.cos + i.beta * cs.sin) >> 15;
    const int32_t e_d =
        q15_sat16(o->magnet - ((o->saliency * i_d_q15) >> 15) - ((alpha * cs.cos + beta * cs.sin) >> 15));
    const int32_t e_q = q15_sat16((alpha * cs.sin - beta * cs.cos) >> 15);
    const int32_t rho_q15 = q15_sat16((e_d * o->along_d + e_q * o->along_q) >> FLUX_ERROR_SHIFT);
    const int32_t nu_q15 = q15_sat16((e_q * o->along_d - e_d * o->along_q) >> FLUX_ERROR_SHIFT);
    const int32_t back_d = (o->back_d * rho_q15) >> 15;
    const int32_t back_q = (o->back_q * rho_q15) >> 15;
    flux_track(c, nu_q15);
    o->rho_q15 = rho_q15;
    o->flux_alpha = flux_held(next_alpha + ((back_d * cs.cos - back_q * cs.sin) >> o->back_shift));
    o->flux_beta = flux_held(next_beta + ((back_d * cs.sin + back_q * cs.cos) >> o->back_shift));
}

/* ==== the angle, by injection ==== */

/*
 * The current loop's extra work when the angle comes from the saliency (injection.h): adds a voltage along d before the
 * controllers' output is limited, and after the compares evaluates the current's response. ISR, constant time, same for both
 * variants.
 *
 * A pulse and its opposite are a pair. The pulse a sample shows is two samples old, or one if voltages act at once: so a second
 * pulse, to which pseudo-random pairs respond, belongs to the previous pair either way.
 *
 * Ranges that exclude overflow: |i| <= 65534; a response is held to 16 bits on each axis of the stator; v_steps <=
 * INJECTION_V_MAX_STEPS, |cross| <= INJECTION_CROSS_MAX, rad <= INJECTION_RAD_MAX_Q8. control/injection.c ensures this.
 */

/* Returns -x for sign -1, x for 0. */
static inline int32_t inject_signed(int32_t x, int32_t sign)
{
    return (x ^ sign) - sign;
}

/*
 * Along d, called first: a pair's first pulse or its opposite. Each pair starts with a shift of the register; a register of
 * zeros stays zero.
 */
static inline int32_t inject_voltage(struct injection *n)
{
    const int32_t first = ~n->first;
    const uint32_t by = (uint32_t)first & 1u;
    const uint32_t fed = ((n->signs >> INJECTION_TAP) ^ (n->signs >> INJECTION_LAST_TAP)) & by;
    n->first = first;
    n->signs = (n->signs << by) | fed;
    return inject_signed(n->v_steps, -(int32_t)(n->signs & 1u) ^ first);
}

/* All ones if this sample shows its pair's first pulse, 0 if the second. */
static inline int32_t inject_shows_first(const struct injection *n)
{
    return n->first ^ n->turned;
}

/* Its sign, 0 or -1; with pseudo-random pairs only valid for the second. */
static inline int32_t inject_shown_sign(const struct injection *n)
{
    return ((int32_t)(n->signs << 30) >> 31) ^ inject_shows_first(n);
}

/* This sample's weight against the one before, in halves, and how often its response counts, in ones: see injection.h. */
static inline int32_t inject_weight(const struct injection *n)
{
    return 1 + inject_signed(n->silent, inject_shows_first(n));
}

/* The controllers' input: without the ripple, half a sample late on average. */
static inline alphabeta_t inject_without_ripple(const struct injection *n, alphabeta_t i)
{
    const int32_t halves = inject_weight(n);
    return (alphabeta_t){n->i_alpha_q15 + (((i.alpha - n->i_alpha_q15) * halves) >> 1),
                         n->i_beta_q15 + (((i.beta - n->i_beta_q15) * halves) >> 1)};
}

/*
 * Changes are taken in the stator frame: in the rotor's, each move of the estimated angle would turn the whole current, and the
 * tracking loop would react to that as a response.
 */
static inline __attribute__((always_inline)) void inject_observe(struct current_loop *c, alphabeta_t i, cossin_t cs)
{
    struct injection *const n = &c->inject;
    const int32_t times = inject_signed(inject_weight(n), inject_shown_sign(n));
    const alphabeta_t step = {i.alpha - n->i_alpha_q15, i.beta - n->i_beta_q15};
    const alphabeta_t seen = {q15_sat16(step.alpha - n->step_alpha_q15), q15_sat16(step.beta - n->step_beta_q15)};
    const dq_t answer = park_q15(seen, cs);
    const int32_t y_d = answer.d * times;
    const int32_t y_q = answer.q * times + ((n->cross_q15 * y_d) >> 15);
    n->i_alpha_q15 = i.alpha;
    n->i_beta_q15 = i.beta;
    n->step_alpha_q15 = step.alpha;
    n->step_beta_q15 = step.beta;
    n->sum_d += y_d;
    n->sum_q += y_q;
    flux_track(c, q15_sat16((q15_sat16(-y_q) * n->rad_q8) >> 8));
}

/* ==== the current controllers ==== */

/*
 * Third stage of the current loop: currents to voltages, in the field's frame. ISR, constant time.
 *
 * The voltages computed from a sample act, on average, a half to one and a half periods later (margins.h). The frame has
 * turned by then, so the voltages are turned with it (lib/advance.h). v_d is limited first, by a constant; a table gives what
 * the circle leaves for v_q (lib/limit.h).
 */

/* Clamps v_d to its range: one instruction on cores that have it. */
static inline int32_t regulate_limit_d(int32_t v_d_steps)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE)
    int32_t limited;
    __asm__("ssat %0, %1, %2" : "=r"(limited) : "I"(LOOP_V_D_BITS), "r"(v_d_steps));
    return limited;
#else
    return q15_clamp(v_d_steps, -LOOP_V_D_MAX_STEPS, LOOP_V_D_MAX_STEPS - 1);
#endif
}

/*
 * |i| <= 65534, references within 16 bits, gains and integrals within lib/pi.h's ranges; |inject_steps| < 2^15 is added in d
 * before any limit. Result: steps, inside the circle.
 */
static inline dq_t regulate(struct current_loop *c, dq_t i, int32_t inject_steps)
{
    c->i_d_q15 = i.d;
    c->i_q_q15 = i.q;
    const int32_t error_d = c->i_d_ref_q15 - i.d;
    const int32_t error_q = c->i_q_ref_q15 - i.q;
    int32_t d = pi_q15_unlimited(c->kp_d_q9, error_d, c->integral_d_q9) + inject_steps;
    int32_t q = pi_q15_unlimited(c->kp_q_q9, error_q, c->integral_q_q9);
    advance_q15(&d, &q, c->turn_q15);

    const int32_t v_d = regulate_limit_d(d);
    c->integral_d_q9 = pi_q15_integrated(c->integral_d_q9, pi_q15_hold(c->ki_q15 * error_d, d, v_d));

    int32_t step_q = c->ki_q15 * error_q;
    pi_q15_saturate(&q, &step_q, c->circle_steps[LOOP_CIRCLE_ZERO + (v_d >> LOOP_CIRCLE_SHIFT)]);
    c->integral_q_q9 = pi_q15_integrated(c->integral_q_q9, step_q);
    c->v_d_steps = v_d;
    c->v_q_steps = q;
    return (dq_t){v_d, q};
}

/* ==== modulation ==== */

/*
 * Fourth stage of the current loop: voltages in the field's frame to the three PWM compares, with dead-time compensation. ISR,
 * constant time.
 *
 * A compare is half the wanted on-time of a phase's high side; the PWM inserts dead time on either side itself. Each lies
 * within the period, with at least a shortest pulse on both sides, for any voltage inside the circle and any current:
 * compensation is within half a dead time, and the circle leaves room for it; tests/target checks the corners. The currents,
 * too, are those at the time the voltages act: they set the compensation's sign. A caller that halves them widens its knee to
 * twice the current, and so on.
 */

#define SIN60_SHIFT 13 /* of SIN60_Q13 */

static inline uint32_t modulate_phase(int32_t half_on, int32_t share_q7)
{
    return (uint32_t)((half_on + share_q7 * LOOP_DEAD) >> LOOP_COMPARE_SHIFT);
}

/* Sign and share of dead time in each phase, at the currents when the voltages act; phase C's negated. */
struct modulate_shares {
    int32_t a_q7, b_q7, minus_c_q7;
};

static inline struct modulate_shares modulate_shares(alphabeta_t i, int32_t turn_q15)
{
    advance_q15(&i.alpha, &i.beta, turn_q15);
    const int32_t i_b_q28 = i.beta * SIN60_Q13 - i.alpha * (1 << (SIN60_SHIFT - 1));
    const int32_t minus_i_c_q28 = i_b_q28 + i.alpha * (1 << SIN60_SHIFT);
    return (struct modulate_shares){deadtime_share_q7(i.alpha, 0), deadtime_share_q7(i_b_q28, SIN60_SHIFT),
                                    deadtime_share_q7(minus_i_c_q28, SIN60_SHIFT)};
}

/* Writing phase C's compare commits all three. Returns the voltage in the stator frame, in steps. */
static inline alphabeta_t modulate(struct pwm_regs *pwm, dq_t v, cossin_t cs, alphabeta_t i, int32_t turn_q15)
{
    const int32_t a = v.d * cs.cos - v.q * cs.sin; /* half the on-time, LOOP_COMPARE_SHIFT fraction bits */
    const int32_t beta_steps = (v.q * cs.cos + v.d * cs.sin) >> 15;
    const int32_t b = beta_steps * SIN60_Q15 - (a >> 1);
    const int32_t minus_c = a + b;
    const int32_t base = LOOP_HALF - svm_middle(a, b, minus_c);

    const struct modulate_shares share = modulate_shares(i, turn_q15);
    pwm->COMPARE_A = modulate_phase(base + a, share.a_q7);
    pwm->COMPARE_B = modulate_phase(base + b, share.b_q7);
    pwm->COMPARE_C = modulate_phase(base - minus_c, -share.minus_c_q7);
    return (alphabeta_t){a >> 15, beta_steps};
}

/* ==== overmodulation ==== */

/*
 * Fourth stage beyond the circle: lengthens the vector (above) and clips its compares to the period. ISR, constant
 * time.
 *
 * A phase either stays at an end for the whole period or leaves it for at least dead times and shortest pulse: anything between
 * goes to the nearer. Lengthened vectors are in quarters of the loop's steps, so three times the circle stays within
 * lib/modulation.h's range.
 */

#define OVERMODULATE_COARSER      2 /* bits */
#define OVERMODULATE_SQUARE_SHIFT 12

/* From a square, 12 bits shorter, to a table index with 8 bits of fraction. */
#define OVERMODULATE_PLACE_Q15 \
    ((int32_t)((1LL << (OVERMODULATION_BITS + 8 + 15 + OVERMODULATE_SQUARE_SHIFT)) / OVERMODULATION_SQUARES))

/* Half of a pulse the PWM need not stretch: two dead times and the shortest pulse. */
#define OVERMODULATE_EDGE (CONFIG_DEAD_COUNTS + (CONFIG_MIN_PULSE_COUNTS + 1) / 2)

_Static_assert(CONFIG_SIX_STEPS <= 32766, "six-step's fundamental is within what the controllers ask for");
_Static_assert(CONFIG_SIX_STEPS > CONFIG_RADIUS_STEPS, "six-step is more than the circle");
_Static_assert(CONFIG_BUS_STEPS / 2 < 1 << 15, "twice the bus, in quarters of steps, within lib/modulation.h's range");

/* |v| <= CONFIG_SIX_STEPS. Result: quarters of steps. */
static inline dq_t overmodulate_longer(dq_t v)
{
    const int32_t beyond = v.d * v.d + v.q * v.q - OVERMODULATION_FROM;
    const int32_t square = q15_clamp(beyond, 0, OVERMODULATION_SQUARES - 1) >> OVERMODULATE_SQUARE_SHIFT;
    const int32_t place_q8 = (square * OVERMODULATE_PLACE_Q15) >> 15;
    const uint16_t *const gain_q12 = &overmodulation_gain_q12[place_q8 >> 8];
    const int32_t rise_q12 = gain_q12[1] - gain_q12[0];
    const int32_t longer_q12 = gain_q12[0] + ((rise_q12 * (place_q8 & 255)) >> 8);
    return (dq_t){(v.d * longer_q12) >> (OVERMODULATION_GAIN_BITS + OVERMODULATE_COARSER),
                  (v.q * longer_q12) >> (OVERMODULATION_GAIN_BITS + OVERMODULATE_COARSER)};
}

static inline uint32_t overmodulate_phase(int32_t half_on, int32_t share_q7)
{
    const int32_t compare =
        (half_on + share_q7 * (LOOP_DEAD >> OVERMODULATE_COARSER)) >> (LOOP_COMPARE_SHIFT - OVERMODULATE_COARSER);
    const int32_t pulsed = q15_clamp(compare, OVERMODULATE_EDGE, CONFIG_HALF_COUNTS - OVERMODULATE_EDGE);
    const int32_t low = compare < OVERMODULATE_EDGE / 2 ? 0 : pulsed;
    return (uint32_t)(compare > CONFIG_HALF_COUNTS - OVERMODULATE_EDGE / 2 ? CONFIG_HALF_COUNTS : low);
}

/* As modulate(). */
static inline void overmodulate(struct pwm_regs *pwm, dq_t wanted, cossin_t cs, alphabeta_t i, int32_t turn_q15)
{
    const dq_t v = overmodulate_longer(wanted);
    const int32_t a = v.d * cs.cos - v.q * cs.sin;
    const int32_t b = ((v.q * cs.cos + v.d * cs.sin) >> 15) * SIN60_Q15 - (a >> 1);
    const int32_t minus_c = a + b;
    const int32_t base = (LOOP_HALF >> OVERMODULATE_COARSER) - svm_middle(a, b, minus_c);

    const struct modulate_shares share = modulate_shares(i, turn_q15);
    pwm->COMPARE_A = overmodulate_phase(base + a, share.a_q7);
    pwm->COMPARE_B = overmodulate_phase(base + b, share.b_q7);
    pwm->COMPARE_C = overmodulate_phase(base - minus_c, -share.minus_c_q7);
}

/* The field's angle at the sample. */
static inline __attribute__((always_inline)) uint32_t current_loop_angle(struct current_loop *c,
                                                                         enum loop_source source)
{
    switch (source) {
    case LOOP_ENCODER:
        return angle_of_rotor(c);
    case LOOP_OBSERVER:
    case LOOP_INJECTION:
    case LOOP_HALL:
        return angle_observed(c);
    default:
        return angle_of_field(c);
    }
}

/* Returns whether the sample has a fault. ISR; tests may call it with their own blocks. */
static inline __attribute__((always_inline)) bool current_loop_step(struct current_loop *c, struct fabric *f,
                                                                    enum loop_source source)
{
    const alphabeta_t i = sense(f);
    /* Here rather than at its use: the compiler still has registers for it. */
    const alphabeta_t coarse = {i.alpha >> c->dead_shift, i.beta >> c->dead_shift};
    const cossin_t cs = cossin_q15(current_loop_angle(c, source));
    const int32_t inject_steps = source == LOOP_INJECTION ? inject_voltage(&c->inject) : 0;
    const alphabeta_t calm = source == LOOP_INJECTION ? inject_without_ripple(&c->inject, i) : i;
    const dq_t v = regulate(c, park_q15(calm, cs), inject_steps);
    const alphabeta_t v_steps = modulate(&f->pwm, v, cs, coarse, c->turn_q15);
    if (source == LOOP_OBSERVER || source == LOOP_INJECTION) {
        if (source == LOOP_OBSERVER) {
            flux_observe(c, i, v_steps);
        } else {
            inject_observe(c, i, cs);
        }
        f->adc.STATUS = ADC_STATUS_EOC;
        return (f->gate.STATUS & ~GATE_STATUS_ENCODER) > c->status_max; /* there may be none */
    }
    angle_observe(c, f->encoder.LATCHED);
    f->adc.STATUS = ADC_STATUS_EOC;
    return f->gate.STATUS > c->status_max;
}

/* The same from Hall switches. */
static inline __attribute__((always_inline)) bool current_loop_step_hall(struct current_loop *c, struct hall *h,
                                                                         struct fabric *f)
{
    const alphabeta_t i = sense(f);
    const alphabeta_t coarse = {i.alpha >> c->dead_shift, i.beta >> c->dead_shift};
    const cossin_t cs = cossin_q15(current_loop_angle(c, LOOP_HALL));
    modulate(&f->pwm, regulate(c, park_q15(i, cs), 0), cs, coarse, c->turn_q15);
    hall_observe(c, h, &f->encoder);
    f->adc.STATUS = ADC_STATUS_EOC;
    return (f->gate.STATUS & ~GATE_STATUS_ENCODER) > c->status_max; /* there may be none */
}

/*
 * The same for field weakening, from the encoder: v_d may take the whole circle, so limits apply in the frame in which the
 * voltages act, reached by an angle instead of two shears. `beyond`: beyond the modulator's circle.
 */
static inline __attribute__((always_inline)) bool current_loop_step_weakening(struct current_loop *c, struct fabric *f,
                                                                              bool beyond)
{
    const alphabeta_t i = sense(f);
    const alphabeta_t coarse = {i.alpha >> c->dead_shift, i.beta >> c->dead_shift};
    const uint32_t angle_q32 = angle_of_rotor(c);
    const dq_t v = regulate_weakening(c, park_q15(i, cossin_q15(angle_q32)));
    const cossin_t acting = cossin_q15(angle_q32 + c->weaken.turn_q32);
    if (beyond) {
        overmodulate(&f->pwm, v, acting, coarse, c->turn_q15);
    } else {
        modulate(&f->pwm, v, acting, coarse, c->turn_q15);
    }
    angle_observe(c, f->encoder.LATCHED);
    f->adc.STATUS = ADC_STATUS_EOC;
    return f->gate.STATUS > c->status_max;
}

#endif
