/* SPDX-License-Identifier: MIT */
/*
 * What the current loop does besides where the saliency tells the angle (injection.h): a voltage along d before the
 * controllers' is limited, and after the compares what the current answered. ISR, constant time, the same for both variants.
 *
 * A pulse and its opposite are a pair. The pulse that a sample shows is two samples old, or one, where voltages act at once:
 * so a second one, where drawn pairs answer, is of the pair before either way.
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

/*
 * Along d, before all that follows: a pair's first pulse or its opposite. A pair begins by moving the register on; one of
 * zeros stays so.
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

/* All ones where the pulse that this sample shows is its pair's first one, 0 where it is the second. */
static inline int32_t inject_shows_first(const struct injection *n)
{
    return n->first ^ n->turned;
}

/* And its sign, 0 or -1; of drawn pairs only the second one's. */
static inline int32_t inject_shown_sign(const struct injection *n)
{
    return ((int32_t)(n->signs << 30) >> 31) ^ inject_shows_first(n);
}

/* In halves, what this sample counts beside the one before, and in ones, how often its answer: see injection.h. */
static inline int32_t inject_weight(const struct injection *n)
{
    return 1 + inject_signed(n->silent, inject_shows_first(n));
}

/* What the controllers see: without the ripple, by half a sample later on the mean. */
static inline alphabeta_t inject_calm(const struct injection *n, alphabeta_t i)
{
    const int32_t halves = inject_weight(n);
    return (alphabeta_t){n->i_alpha_q15 + (((i.alpha - n->i_alpha_q15) * halves) >> 1),
                         n->i_beta_q15 + (((i.beta - n->i_beta_q15) * halves) >> 1)};
}

/*
 * Changes are taken in the frame of the stator: in the rotor's, each move of the believed angle would turn the whole current,
 * which a tracking loop would take for a response, and answer.
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

#endif
