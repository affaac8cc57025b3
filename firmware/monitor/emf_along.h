/* SPDX-License-Identifier: MIT */
/* The EMF along the axis q, counted along its speed w: |w| psi, if the frame is the rotor's. Voltages in Q15 of v_range. */
#ifndef FIRMWARE_MONITOR_EMF_ALONG_H
#define FIRMWARE_MONITOR_EMF_ALONG_H

#include <stdint.h>

#include "firmware/axis/axis.h"
#include "lib/q15.h"

/* What the magnets would make at this speed. Slow loop. */
static inline int32_t emf_expected_q15(const struct axis *a, int32_t w_q15)
{
    return (q15_abs(w_q15) * a->tuning.emf_q12) >> 12;
}

/* What the voltage shows behind resistance and armature: e_q = v_q - R i_q - w Ld i_d. Slow loop. */
static inline int32_t emf_along_q15(const struct axis *a, int32_t w_q15)
{
    const struct tuning *const t = &a->tuning;
    const volatile struct current_loop *const c = &a->loop;
    const int32_t armature_q15 = tuning_reactive_q15(w_q15, c->i_d_q15, t->x_d_q11);
    const int32_t seen_q15 = c->v_q_q15 - ((t->r_q12 * c->i_q_q15) >> 12) - armature_q15;
    return w_q15 < 0 ? -seen_q15 : seen_q15;
}

#endif
