/* SPDX-License-Identifier: MIT */
/*
 * What the interrupt computes, in C: the definition of current_loop_isr.S, from which tests must not tell it apart.
 *
 * sample -> Clarke -> Park -> PI d, PI q -> turn -> circle -> inverse Park and Clarke -> space vector -> dead time -> edges
 *
 * The voltages computed from the sample at the start of period k take effect at the start of period k+1 and act, on average, in
 * its middle: 1.5 periods after the sample. The rotor has turned on by then, and the currents with it: both vectors are turned.
 *
 * Nothing overflows: phase currents are within +-32767 (ADC block), so |i| <= 65534; references within 16 bits, gains within
 * lib/pi.h's ranges. Every edge is right for any of that: the voltage lies inside the circle, a compensation within half a
 * dead time; tests/target checks it at the corners.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_STEP_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_STEP_H

#include "firmware/control/current_loop.h"
#include "lib/advance.h"
#include "lib/deadtime.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

/* The sine of 60 degrees: in Q15 for voltages, in Q13 for currents, which are larger. */
#define LOOP_SIN60_Q15 28378
#define LOOP_SIN60_Q13 7094

struct current_edges {
    uint32_t count[12]; /* as the registers stand: rise, fall of a high side, then rise, fall of its low side */
};

static inline void current_loop_regulate(struct current_loop *c, dq_t i)
{
    const int32_t error_d = c->i_d_ref_q15 - i.d;
    const int32_t error_q = c->i_q_ref_q15 - i.q;
    int32_t d = pi_q15_unlimited(c->kp_d_q9, error_d, c->integral_d_q9);
    int32_t q = pi_q15_unlimited(c->kp_q_q9, error_q, c->integral_q_q9);
    advance_q15(&d, &q, c->turn_q15);

    c->v_d_q4 = q15_clamp(d, -LOOP_V_D_MAX_Q4, LOOP_V_D_MAX_Q4 - 1);
    c->integral_d_q9 = pi_q15_integrated(c->integral_d_q9, pi_q15_hold(c->ki_q15 * error_d, d, c->v_d_q4));

    int32_t step_q = c->ki_q15 * error_q;
    pi_q15_saturate(&q, &step_q, c->circle_q4[LOOP_CIRCLE_ZERO + (c->v_d_q4 >> LOOP_CIRCLE_SHIFT)]);
    c->integral_q_q9 = pi_q15_integrated(c->integral_q_q9, step_q);
    c->v_q_q4 = q;
}

/* The four edges of a phase: a low side is off from a dead time before its high side is on to one after it is off. */
static inline void current_loop_phase(uint32_t *edges, int32_t rise_q19)
{
    const uint32_t rise = (uint32_t)(rise_q19 >> 19);
    const uint32_t fall = LOOP_PWM_COUNTS - rise;
    edges[0] = rise;
    edges[1] = fall;
    edges[2] = fall + LOOP_DEAD_COUNTS;
    edges[3] = rise - LOOP_DEAD_COUNTS;
}

static inline void current_loop_modulate(const struct current_loop *c, cossin_t cs, alphabeta_t i,
                                         struct current_edges *out)
{
    const int32_t a = c->v_d_q4 * cs.cos - c->v_q_q4 * cs.sin; /* Q19 of half on-time */
    const int32_t beta_q4 = (c->v_q_q4 * cs.cos + c->v_d_q4 * cs.sin) >> 15;
    const int32_t b = beta_q4 * LOOP_SIN60_Q15 - (a >> 1);
    const int32_t minus_c = a + b;
    const int32_t base = LOOP_RISE_Q19 + svm_middle(a, b, minus_c);

    advance_q15(&i.alpha, &i.beta, c->turn_q15);
    const int32_t i_b_q28 = i.beta * LOOP_SIN60_Q13 - i.alpha * 4096;
    const int32_t minus_i_c_q28 = i_b_q28 + i.alpha * 8192;
    current_loop_phase(&out->count[0], base - a - deadtime_share_q7(i.alpha, 0) * LOOP_DEAD_Q12);
    current_loop_phase(&out->count[4], base - b - deadtime_share_q7(i_b_q28, 13) * LOOP_DEAD_Q12);
    current_loop_phase(&out->count[8], base + minus_c + deadtime_share_q7(minus_i_c_q28, 13) * LOOP_DEAD_Q12);
}

static inline void current_loop_step(struct current_loop *c, int32_t ia_q15, int32_t ib_q15, uint32_t encoder_counts,
                                     struct current_edges *out)
{
    const cossin_t cs = cossin_q15(c->pll.angle_q32 + c->angle_offset_q32);
    const alphabeta_t i = clarke_q15(ia_q15, ib_q15);
    const dq_t i_dq = park_q15(i, cs);
    c->i_d_q15 = i_dq.d;
    c->i_q_q15 = i_dq.q;
    current_loop_regulate(c, i_dq);
    current_loop_modulate(c, cs, i, out);
    pll_step(&c->pll, encoder_counts * c->encoder_scale_q32);
}

#endif
