/* SPDX-License-Identifier: MIT */
/*
 * Fourth stage of the current loop: voltages in the frame of the field to the three compares of the PWM, with the compensation
 * of the dead time that the PWM makes. ISR, constant time.
 *
 * A compare is half of the time for which a phase's high side is wished on; the dead time shortens either side's by itself.
 * Each lies within the period, with a shortest pulse at least on both sides, for any voltage inside the circle and any current:
 * a compensation is within half a dead time, and the circle keeps room for it; tests/target checks it at the corners. The
 * currents, too, are those of when the voltages act (stage_regulate.h): they choose the sign of the compensation. A caller that
 * gives them halved widens its knee to twice the current, and so on.
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

/* Which way dead time acts in each phase, and how much of it, at the currents of when the voltages act; phase C's negated. */
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

/* The one of phase C hands over all three. Returns the voltage in the frame of the stator, in steps. */
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
