/* SPDX-License-Identifier: MIT */
/*
 * Third stage of the current loop: currents to voltages, in the field's frame. ISR, constant time.
 *
 * The voltages computed from a sample act, on average, a half to one and a half periods later (settings/delay.h). The frame has
 * turned by then, so the voltages are turned with it (lib/advance.h). v_d is limited first, by a constant; a table gives what
 * the circle leaves for v_q (lib/limit.h).
 */
#ifndef FIRMWARE_CONTROL_STAGE_REGULATE_H
#define FIRMWARE_CONTROL_STAGE_REGULATE_H

#include "firmware/control/current_loop.h"
#include "lib/advance.h"
#include "lib/pi.h"

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

#endif
