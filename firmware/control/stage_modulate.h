/* SPDX-License-Identifier: MIT */
/*
 * Fourth stage of the current loop: voltages in the frame of the field to the twelve edges of CorePWM, with the dead time and
 * its compensation. ISR, constant time.
 *
 * Every edge is right for any voltage inside the circle and any current: a compensation is within half a dead time, and the
 * circle keeps room for it; tests/target checks it at the corners. The currents, too, are those of 1.5 periods later
 * (stage_regulate.h): they choose the sign of the compensation. A caller that gives them halved widens its knee to twice the
 * current, and so on.
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

/*
 * The four edges of a phase: a low side is off from a dead time before its high side is on to one after it is off. `rise` has
 * LOOP_EDGE_SHIFT fraction bits. Registers: POSEDGE and NEGEDGE of the high side, then of the low side.
 */
static inline void modulate_phase(volatile uint32_t *edges, int32_t rise_fraction)
{
    const uint32_t rise = (uint32_t)(rise_fraction >> LOOP_EDGE_SHIFT);
    const uint32_t fall = CONFIG_PWM_COUNTS - rise;
    edges[0] = rise;
    edges[1] = fall;
    edges[2] = fall + CONFIG_DEAD_COUNTS;
    edges[3] = rise - CONFIG_DEAD_COUNTS;
}

/* SYNC_UPDATE is 0 meanwhile: edges in part are not taken. */
static inline void modulate(struct corepwm_regs *pwm, dq_t v, cossin_t cs, alphabeta_t i, int32_t turn_q15)
{
    const int32_t a = v.d * cs.cos - v.q * cs.sin; /* half the on-time, LOOP_EDGE_SHIFT fraction bits */
    const int32_t beta_steps = (v.q * cs.cos + v.d * cs.sin) >> 15;
    const int32_t b = beta_steps * SIN60_Q15 - (a >> 1);
    const int32_t minus_c = a + b;
    const int32_t base = LOOP_RISE + svm_middle(a, b, minus_c);

    advance_q15(&i.alpha, &i.beta, turn_q15);
    const int32_t i_b_q28 = i.beta * SIN60_Q13 - i.alpha * (1 << (SIN60_SHIFT - 1));
    const int32_t minus_i_c_q28 = i_b_q28 + i.alpha * (1 << SIN60_SHIFT);
    modulate_phase(&pwm->PWM1_POSEDGE, base - a - deadtime_share_q7(i.alpha, 0) * LOOP_DEAD);
    modulate_phase(&pwm->PWM3_POSEDGE, base - b - deadtime_share_q7(i_b_q28, SIN60_SHIFT) * LOOP_DEAD);
    modulate_phase(&pwm->PWM5_POSEDGE, base + minus_c + deadtime_share_q7(minus_i_c_q28, SIN60_SHIFT) * LOOP_DEAD);
}

#endif
