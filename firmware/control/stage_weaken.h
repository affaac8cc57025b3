/* SPDX-License-Identifier: MIT */
/*
 * The third stage in field weakening: as current_loop_step.h, with two differences. ISR, constant time.
 *
 * Priority. Beyond MTPV, a machine with much reluctance has nearly all its voltage in d. So v_d may take nearly all of the
 * circle, v_q the rest: a root, no table. That works while motoring: a lack of v_q reduces i_q, and with it v_d. While braking,
 * or with v_q against the speed, it would increase i_q and take still more v_d. So then v_q comes first: a lack of v_d changes
 * the field so that less v_q is needed.
 *
 * Retreat. If v_q wants more than the circle leaves, in the EMF's direction, the EMF is too large: the bus has fallen, or the
 * shaft is faster than in the slow loop's last step. i_d then drops below its reference by a share of the missing voltage over
 * w L_d, smoothed over four samples. A transient of d or the response to a reference step does not count as a lack: v_q is
 * compared with what a steady d would leave. Otherwise a retreat, which itself takes voltage in d, would cause the next. The
 * missing voltage is mostly the controller's response to a runaway i_q, which already integrates the voltage: an integrating
 * retreat would oscillate. The retreat bridges the time until the slow loop sets new references.
 */
#ifndef FIRMWARE_CONTROL_STAGE_WEAKEN_H
#define FIRMWARE_CONTROL_STAGE_WEAKEN_H

#include "firmware/control/current_loop.h"
#include "lib/limit.h"
#include "lib/pi.h"

#define WEAKEN_RETREAT_SHIFT 7 /* of retreat_q22 to Q15 */
#define WEAKEN_SMOOTH_SHIFT  2
#define WEAKEN_GAIN_MAX_Q15  16383

/*
 * For d when first: a 128th of the circle is left, which gives q an eighth to change v_q. For q when first: 13/16, which leaves
 * d 7/12: when the bus has fallen, q must shed current, and d runs away meanwhile.
 */
#define WEAKEN_D_MAX_STEPS(radius) ((radius) - ((radius) >> 7))
#define WEAKEN_Q_MAX_STEPS(radius) (13 * (radius) / 16)

#define WEAKEN_DEAD_STEPS (CONFIG_RADIUS_STEPS / 16) /* tolerance for harmonics of the EMF */

/* One step of the retreat: `over_steps` is v_q's lack in the EMF's direction, 0...65535. */
static inline int32_t weaken_retreat_q22(int32_t retreat_q22, int32_t over_steps, int32_t gain_q15, int32_t max_q15)
{
    const int32_t wanted_q22 = (over_steps * gain_q15) >> (15 - WEAKEN_RETREAT_SHIFT);
    return q15_min(retreat_q22 + ((wanted_q22 - retreat_q22) >> WEAKEN_SMOOTH_SHIFT), max_q15 << WEAKEN_RETREAT_SHIFT);
}

/* Exchanges two numbers if the mask is all ones, not if it is 0. */
static inline void weaken_exchange(int32_t *a, int32_t *b, int32_t mask)
{
    const int32_t differing = (*a ^ *b) & mask;
    *a ^= differing;
    *b ^= differing;
}

/* Scaling the error scales kp and ki. |error| <= PI_ERROR_MAX, 0 <= share <= 1.0 = 256. */
static inline int32_t weaken_softer(int32_t error, int32_t share_q8)
{
    return (error * share_q8) >> 8;
}

/* Ranges as regulate()'s; 0 <= first_max_steps <= radius_steps <= 32766, |gain_q15| <= WEAKEN_GAIN_MAX_Q15. */
static inline dq_t regulate_weakening(struct current_loop *c, dq_t i)
{
    c->i_d_q15 = i.d;
    c->i_q_q15 = i.q;
    const int32_t retreat_q22 = c->weaken.retreat_q22;
    const int32_t error_d =
        weaken_softer(c->i_d_ref_q15 - (retreat_q22 >> WEAKEN_RETREAT_SHIFT) - i.d, c->weaken.gain_share_q8);
    const int32_t error_q = weaken_softer(c->i_q_ref_q15 - i.q, c->weaken.gain_share_q8);
    const int32_t wanted_q = pi_q15_unlimited(c->kp_q_q9, error_q, c->integral_q_q9);
    int32_t v_d = pi_q15_unlimited(c->kp_d_q9, error_d, c->integral_d_q9);
    int32_t v_q = wanted_q;
    int32_t step_d = c->ki_q15 * error_d;
    int32_t step_q = c->ki_q15 * error_q;

    const int32_t q_first = c->weaken.q_first;
    weaken_exchange(&v_d, &v_q, q_first);
    weaken_exchange(&step_d, &step_q, q_first);
    pi_q15_saturate(&v_d, &step_d, c->weaken.first_max_steps);
    pi_q15_saturate(&v_q, &step_q, circle_rest_q15(v_d, c->weaken.radius_steps));
    weaken_exchange(&v_d, &v_q, q_first);
    weaken_exchange(&step_d, &step_q, q_first);
    c->integral_d_q9 = pi_q15_integrated(c->integral_d_q9, step_d);
    c->integral_q_q9 = pi_q15_integrated(c->integral_q_q9, step_q);

    const int32_t gain_q15 = c->weaken.gain_q15;
    const int32_t sign = gain_q15 >> 31; /* all ones for negative w: negates, less one */
    const int32_t over_steps = q15_min((wanted_q - v_q) ^ sign, (wanted_q ^ sign) - c->weaken.room_q_steps);
    c->weaken.retreat_q22 = weaken_retreat_q22(retreat_q22, q15_max(over_steps - WEAKEN_DEAD_STEPS, 0),
                                               q15_abs(gain_q15), c->weaken.max_q15);
    c->v_d_steps = v_d;
    c->v_q_steps = v_q;
    return (dq_t){v_d, v_q};
}

#endif
