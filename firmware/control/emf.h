/* SPDX-License-Identifier: MIT */
/*
 * The back-EMF as the voltages and currents show it, in the frame in which the encoder says that the rotor stands.
 *
 *     e = v - R i - j w Lq i
 *
 * With Lq in both axes e has the direction of the q axis of the true rotor, whatever saliency there is (extended EMF: Chen and
 * others, IEEE Trans. Ind. Electron. 50(2), 2003). So its angle to the believed q axis is the error of the encoder's angle. A
 * wrong flux changes its length only. A wrong resistance turns it by what flows in d; a wrong Lq by Lq i_q / psi, and that is
 * learnt while the motor turns, since it comes with the load and a slip of the encoder does not.
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

enum emf_verdict {
    EMF_AGREES,
    EMF_TURNED,   /* more than about 15 degrees away from the q axis */
    EMF_REVERSED, /* more than 90 */
};

struct emf_vector {
    int32_t d_q15, q_q15;
};

struct emf {
    struct emf_vector now;      /* of the last sample */
    struct emf_vector filtered; /* over 4 ms */
    int32_t expected_q15;       /* |w| psi as the parameters have it */
    int32_t unsure_q15;         /* what resistance and dead time may hide, half of R taken for unknown */
    int32_t moving_q15;   /* L di/dt of q: in its voltage while a current is on its way, and may turn that round */
    int32_t slack_q15;    /* by how much d may be off: R i_d, L di/dt and dead time */
    int32_t reaction_q15; /* |w Lq i_q| */
    int32_t i_q_q15;      /* of the last step */
    int32_t lq_q19;       /* reactance of q at the base speed as learnt */
    int32_t learnt;       /* for how long there was something to learn from; at most EMF_LEARNT_STEPS */
};

#define EMF_LEARNT_STEPS 128

/* Forgets what was learnt. At `on`. */
void emf_reset(struct emf *e, const struct tuning *t);

/*
 * One sample. The magnets turn at the rotor's speed; what the armature reacts with goes by the speed of the frame that the
 * currents are regulated in. Both are the observer's unless the encoder is in doubt. About 60 cycles.
 */
void emf_step(struct emf *e, const volatile struct current_loop *c, const struct tuning *t, int32_t rotor_w_q15,
              int32_t frame_w_q15);

/* Whether there is enough EMF to judge by: four times what may hide it (margin m of the flux observer's literature). */
static inline bool emf_is_clear(const struct emf *e)
{
    return e->expected_q15 > 4 * e->unsure_q15;
}

/* What the filtered vector says of the encoder's angle, at a speed of this sign. */
enum emf_verdict emf_judge(const struct emf *e, bool backwards);

/*
 * What the last sample says, compared with `before`: what was in d then for other reasons still is, so there is less to allow
 * for.
 */
enum emf_verdict emf_judge_change(const struct emf *e, const struct emf_vector *before, bool backwards);

/* The angle from the q axis that belongs to the speed's sign: by so much the rotor is ahead of the frame. Cold. */
uint32_t emf_angle_q32(const struct emf_vector *v, bool backwards);

/* The same in degrees, -180...180: a fault's detail. */
int32_t emf_angle_deg(const struct emf_vector *v, bool backwards);

#endif
