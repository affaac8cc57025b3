/* SPDX-License-Identifier: MIT */
/*
 * The back-EMF calculated from voltages and currents, in the rotor frame the encoder gives.
 *
 *     e = v - R i - j w Lq i
 *
 * With Lq in both axes, e points along the true rotor's q axis whatever the saliency (extended EMF: Chen and others, IEEE
 * Trans. Ind. Electron. 50(2), 2003). So its angle from the assumed q axis is the encoder's angle error. A wrong flux changes
 * only its length. A wrong resistance turns it in proportion to i_d; a wrong Lq turns it by Lq i_q / psi. Lq is learnt while
 * the motor turns, since its error follows the load and an encoder slip does not.
 *
 * Voltages Q15 of v_range, currents Q15 of i_range, speed as current_loop_w_q15(). Context: slow loop, after
 * current_loop_follow().
 */
#ifndef FIRMWARE_CONTROL_EMF_H
#define FIRMWARE_CONTROL_EMF_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"
#include "lib/q15.h"

enum emf_verdict {
    EMF_AGREES,
    EMF_TURNED,   /* more than about 15 degrees, and a count of the encoder, away from the q axis */
    EMF_REVERSED, /* more than 90 */
};

struct emf_vector {
    int32_t d_q15, q_q15;
};

struct emf {
    struct emf_vector now;      /* of the last sample */
    struct emf_vector filtered; /* over 2 steps, up to 16 */
    int32_t expected_q15;       /* |w| psi from the parameters */
    int32_t uncertain_q15;      /* uncertainty by dead time and an error of R of 50 % */
    int32_t moving_q15;         /* L di/dt of q: in v_q while the current changes, may reverse its sign */
    int32_t tolerance_q15;      /* possible error of d: R i_d, L di/dt and dead time */
    int32_t reaction_q15;       /* |w Lq i_q| */
    int32_t i_q_q15;            /* of the last step */
    int32_t lq_q19;             /* learnt q reactance at the base speed */
    uint32_t filter_shift;      /* of `filtered` */
    int32_t turned_q15;         /* allowed tangent of its angle */
    int32_t learnt;             /* steps with adaptation; at most EMF_LEARNT_STEPS */
};

#define EMF_LEARNT_STEPS 128

/* Clears what was learnt. At `on`. */
void emf_reset(struct emf *e, const struct tuning *t);

/*
 * After emf_reset(): the frame follows an encoder whose counts are so far apart, electrical. Each count turns the frame, and
 * the controllers respond with a voltage that is not EMF, several times larger at 64 counts: the filter is longer.
 */
void emf_set_count(struct emf *e, uint32_t count_q32);

/*
 * One sample. The magnets' EMF follows the rotor's speed, the armature reaction that of the frame in which the currents are
 * regulated. Both come from the PLL unless the encoder is suspect. About 60 cycles.
 */
void emf_step(struct emf *e, const volatile struct current_loop *c, const struct tuning *t, int32_t rotor_w_q15,
              int32_t frame_w_q15);

/* Whether there is enough EMF: four times the uncertainty (margin m in the flux observer literature). */
static inline bool emf_is_clear(const struct emf *e)
{
    return e->expected_q15 > 4 * e->uncertain_q15;
}

/* Judges the encoder's angle by the filtered vector, at a speed of this sign. */
enum emf_verdict emf_judge(const struct emf *e, bool backwards);

/* Judges the last sample against `before`: other causes of a d component are in both, so a smaller tolerance suffices. */
enum emf_verdict emf_judge_change(const struct emf *e, const struct emf_vector *before, bool backwards);

/* The angle from the q axis for the speed's sign: how far the rotor leads the frame. Cold. */
uint32_t emf_angle_q32(const struct emf_vector *v, bool backwards);

/* The same in degrees, -180...180: a fault's detail. */
int32_t emf_angle_deg(const struct emf_vector *v, bool backwards);

/* ---- along the axis q of any frame, counted along its speed w: |w| psi if the frame is the rotor's ---- */

/* The magnets' EMF at this speed, from the parameters. Slow loop. */
static inline int32_t emf_expected_q15(const struct tuning *t, int32_t w_q15)
{
    return (q15_abs(w_q15) * t->emf_q12) >> 12;
}

/* The EMF from the voltage: e_q = v_q - R i_q - w Ld i_d. Slow loop. */
static inline int32_t emf_along_q15(const volatile struct current_loop *c, const struct tuning *t, int32_t w_q15)
{
    const int32_t armature_q15 = tuning_reactive_q15(w_q15, c->i_d_q15, t->x_d_q11);
    const int32_t seen_q15 = c->v_q_q15 - ((t->r_q12 * c->i_q_q15) >> 12) - armature_q15;
    return w_q15 < 0 ? -seen_q15 : seen_q15;
}

#endif
