/* SPDX-License-Identifier: MIT */
/*
 * Finds the magnets at standstill in a machine whose reluctance outweighs them: an alternating voltage along one angle after
 * another over half a turn, and the current response. A voltage V along the angle a gives, in the frame of a,
 *
 *     d_i + j d_q  ~  V (Y0 + Y1 exp(2j (m - a))),    Y0, Y1 = (1/Ld +- 1/Lq) / 2
 *
 * with the magnets at m: times exp(2j a) and summed over a, only Y1 exp(2j m) is left. That is m up to half a turn. The
 * torque alternates, so nothing moves; the magnets' axis is one of symmetry, even where iron saturates.
 */
#ifndef FIRMWARE_COMMISSION_SALIENCY_H
#define FIRMWARE_COMMISSION_SALIENCY_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/measure.h"

#define SALIENCY_ANGLES 16u

struct saliency {
    uint32_t angle; /* which one */
    uint32_t ms;    /* within the voltage pattern there */
    int32_t v_q15, i_q15;
    int32_t steady_d_q15, steady_q_q15; /* voltage on top of the alternating one */
    struct measure_axes sums;
};

/* `v_q15`: the voltage; along the magnets it changes the current by `i_q15` peak to peak in a millisecond. Slow loop. */
void saliency_start(struct saliency *s, int32_t v_q15, int32_t i_q15);

/*
 * One step a millisecond; true when all is measured and no voltage is held any more. Meanwhile the current loop holds voltages
 * (gains of zero) and LOOP_FORCED is its source. `encoder_q32`: electrical angle of the encoder. Slow loop.
 */
bool saliency_step(struct saliency *s, volatile struct current_loop *c, uint32_t encoder_q32);

/* From the encoder's angle to the magnets', or half a turn more. Slow loop. */
uint32_t saliency_offset_q32(const struct saliency *s);

/* True if Y1 is at least a tenth of Y0: there is an axis to find. Slow loop. */
bool saliency_seen(const struct saliency *s);

#endif
