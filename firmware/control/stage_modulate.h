/* SPDX-License-Identifier: MIT */
/*
 * Fourth stage of the current loop: voltages in the field's frame to the three PWM compares, with dead-time compensation. ISR,
 * constant time.
 *
 * A compare is half the wanted on-time of a phase's high side; the PWM inserts dead time on either side itself. Each lies
 * within the period, with at least a shortest pulse on both sides, for any voltage inside the circle and any current:
 * compensation is within half a dead time, and the circle leaves room for it; tests/target checks the corners. The currents,
 * too, are those at the time the voltages act (stage_regulate.h): they set the compensation's sign. A caller that halves them
 * widens its knee to twice the current, and so on.
 */
#ifndef FIRMWARE_CONTROL_STAGE_MODULATE_H
#define FIRMWARE_CONTROL_STAGE_MODULATE_H

#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop.h"
#include "lib/advance.h"
#include "lib/deadtime.h"
#include "lib/modulation.h"
#include "lib/transform_q15.h"

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

#endif
