/* SPDX-License-Identifier: MIT */
/*
 * Finds the encoder's counting direction from any motion of the magnets, wherever the field stands.
 *
 * The EMF, e = j w psi exp(j angle), is a vector that turns with the rotor. Divided by the speed and compared with the
 * encoder's angle x, it is a rotation of (cos x, sin x) if the encoder counts with the rotor, and a reflection if it counts
 * backwards. The sums over the motion
 *
 *     cd = sum n e_d cos x    sd = sum n e_d sin x
 *     cq = sum n e_q cos x    sq = sum n e_q sin x        n: counts per step
 *
 * estimate that mapping; the sign of its determinant cd sq - cq sd tells the two apart. A constant part of e, from a wrong
 * resistance or dead time, cancels between forward and back. Nothing shows as long as the rotor barely turns.
 */
#ifndef FIRMWARE_COMMISSION_ENCODER_SENSE_H
#define FIRMWARE_COMMISSION_ENCODER_SENSE_H

#include <stdint.h>

struct encoder_sense {
    int64_t cd, sd, cq, sq; /* Q15 times Q15 times counts */
};

/* Forgets all motion. Slow loop. */
void encoder_sense_start(struct encoder_sense *s);

/*
 * One step: `e_d_q15`, `e_q_q15` are the EMF along and across the field at `field_q32`; the encoder is at `angle_q32`,
 * electrical, and has moved by `moved` counts. Slow loop.
 */
void encoder_sense_step(struct encoder_sense *s, int32_t e_d_q15, int32_t e_q_q15, uint32_t field_q32,
                        uint32_t angle_q32, int32_t moved);

/*
 * How much better one direction fits than the other: (|E+|^2 - |E-|^2) / (|E+|^2 + |E-|^2), 1.0 = 32768; negative: it counts
 * backwards. Without noise a swing by 60 degrees gives 0.19, one by 90 degrees 0.42, one by half a turn 1. Slow loop.
 */
int32_t encoder_sense_q15(const struct encoder_sense *s);

#endif
