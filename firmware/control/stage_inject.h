/* SPDX-License-Identifier: MIT */
/*
 * What the current loop does besides where the saliency tells the angle (injection.h): a voltage along d before the
 * controllers' is limited, and after the compares what the current answered. ISR, constant time.
 *
 * Ranges, so that nothing overflows: |i| <= 65534; a response is held to 16 bits on each axis of the stator; v_steps <=
 * INJECTION_V_MOST_STEPS, |cross| <= INJECTION_CROSS_MOST, rad <= INJECTION_RAD_MOST_Q8. control/injection.c keeps them.
 */
#ifndef FIRMWARE_CONTROL_STAGE_INJECT_H
#define FIRMWARE_CONTROL_STAGE_INJECT_H

#include "firmware/control/current_loop.h"
#include "firmware/control/stage_flux.h"
#include "lib/q15.h"
#include "lib/transform_q15.h"

/* With -1 its negative, with 0 itself. */
static inline int32_t inject_signed(int32_t x, int32_t sign)
{
    return (x ^ sign) - sign;
}

/* What the controllers see: without the ripple, by half a sample later. */
static inline alphabeta_t inject_mean(const struct injection *n, alphabeta_t i)
{
    return (alphabeta_t){(i.alpha + n->i_alpha_q15) >> 1, (i.beta + n->i_beta_q15) >> 1};
}

/* Along d, of the other sign each time. */
static inline int32_t inject_voltage(struct injection *n)
{
    const int32_t sign = ~n->sign;
    n->sign = sign;
    return inject_signed(n->v_steps, sign);
}

/*
 * After inject_voltage(): the sign of the voltage that this sample shows is the present one, two samples old, or its opposite.
 * Changes are taken in the frame of the stator: in the rotor's, each move of the believed angle would turn the whole current,
 * which a tracking loop would take for a response, and answer.
 */
static inline __attribute__((always_inline)) void inject_observe(struct current_loop *c, alphabeta_t i, cossin_t cs)
{
    struct injection *const n = &c->inject;
    const int32_t sign = n->sign ^ n->turned;
    const alphabeta_t step = {i.alpha - n->i_alpha_q15, i.beta - n->i_beta_q15};
    const alphabeta_t seen = {q15_sat16(step.alpha - n->step_alpha_q15), q15_sat16(step.beta - n->step_beta_q15)};
    const dq_t answer = park_q15(seen, cs);
    const int32_t y_d = inject_signed(answer.d, sign);
    const int32_t y_q = inject_signed(answer.q, sign) + ((n->cross_q15 * y_d) >> 15);
    n->i_alpha_q15 = i.alpha;
    n->i_beta_q15 = i.beta;
    n->step_alpha_q15 = step.alpha;
    n->step_beta_q15 = step.beta;
    n->sum_d += y_d;
    n->sum_q += y_q;
    flux_track(c, q15_sat16((q15_sat16(-y_q) * n->rad_q8) >> 8));
}

#endif
