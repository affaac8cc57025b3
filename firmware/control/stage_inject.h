/* SPDX-License-Identifier: MIT */
/*
 * The current loop's extra work when the angle comes from the saliency (injection.h): adds a voltage along d before the
 * controllers' output is limited, and after the compares evaluates the current's response. ISR, constant time, same for both
 * variants.
 *
 * A pulse and its opposite are a pair. The pulse a sample shows is two samples old, or one if voltages act at once: so a second
 * pulse, to which pseudo-random pairs respond, belongs to the previous pair either way.
 *
 * Ranges that exclude overflow: |i| <= 65534; a response is held to 16 bits on each axis of the stator; v_steps <=
 * INJECTION_V_MOST_STEPS, |cross| <= INJECTION_CROSS_MOST, rad <= INJECTION_RAD_MOST_Q8. control/injection.c ensures this.
 */
#ifndef FIRMWARE_CONTROL_STAGE_INJECT_H
#define FIRMWARE_CONTROL_STAGE_INJECT_H

#include "firmware/control/current_loop.h"
#include "firmware/control/stage_flux.h"
#include "lib/q15.h"
#include "lib/transform_q15.h"

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
static inline alphabeta_t inject_calm(const struct injection *n, alphabeta_t i)
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

#endif
