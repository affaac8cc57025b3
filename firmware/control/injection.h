/* SPDX-License-Identifier: MIT */
/*
 * The rotor's angle from its saliency, at any speed but high ones: voltage pulses along the assumed magnet axis, every second
 * one the opposite of the first, and the current's response across it. Sources: Kim, Ha, Sul, "PWM switching frequency signal
 * injection sensorless method in IPMSM", IEEE Trans. Ind. Appl. 48(5), 2012; saturation across the axes: Guglielmi, Pastorelli,
 * Vagati, IEEE Trans. Ind. Appl. 42(6), 2006.
 *
 * From a sample to the next the voltage s U, s = +-1, changes the current by s U T Y, where Y is the inverse of the incremental
 * inductances. The second difference removes whatever is constant or linear in time; multiplying by s gives both a constant
 * sign:
 *
 *     y_d = s (i_d - 2 i_d' + i_d'') = 2 U T (Y0 + Y1 cos 2(m - a)),    Y0, Y1 = (1 / Ld +- 1 / Lq) / 2
 *     y_q = s (i_q - 2 i_q' + i_q'') = 2 U T Y1 sin 2(m - a)
 *
 * with the magnets at m and the voltage along a. In saturated iron L_dq turns this axis by up to ten degrees; y_q + k y_d with
 * k = L_dq / L_qq is zero on the magnets' axis for any Ld. So the angle leads by
 *
 *     nu = -(y_q + k y_d) / G,    G = 4 U T Y1, measured at the start
 *
 * which the flux observer's tracking loop removes (current_loop_step.h): two integrators with a double pole at 60 Hz or less,
 * as fast as a load step needs, and slower where the response per degree is small, because the sensors' noise is not.
 *
 * Two variants, one interrupt:
 *
 *   tone    all pairs of pulses are equal, so the sign alternates each sample, and current alternates by +-U T Y / 2 at half
 *           the sampling rate, which is audible. Each sample gives a response. The controllers see the mean of two samples,
 *           which cancels the ripple
 *   silent  the sign of each pair is the newest bit of a feedback shift register, x^31 + x^28 + 1: the pairs are pseudo-
 *           random, 2^31 - 1 of them before they repeat, half of them each way up to one. Each pair cancels itself, so
 *           current does not drift; between pairs it is at rest, within them +-U T Y off. Its spectrum has no line. A pair
 *           responds once, at its end, and counts twice: the sums are as large. The controllers see the samples between
 *           pairs, each twice. White sensor noise s turns the angle by sqrt(3 / 4) of what it does with
 *           tone: n samples of tone sum to 2 n U T Y with noise 4 s sqrt(n), n / 2 pairs to the same with 2 s sqrt(6 n / 2)
 *
 * A register of zeros stays zero: the tone is the same register, empty.
 *
 * Formats: currents Q15; responses y likewise, LSB; voltages in steps; nu Q15, radians.
 */
#ifndef FIRMWARE_CONTROL_INJECTION_H
#define FIRMWARE_CONTROL_INJECTION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/tuning.h"

/* Limits of the interrupt's inputs: its products stay within 32 bits. */
#define INJECTION_V_MAX_STEPS 12288 /* 30 % of the bus */
#define INJECTION_CROSS_MAX   8191
#define INJECTION_RAD_MAX_Q8  65535

struct injection {
    /* the interrupt's */
    uint32_t signs;                        /* of the pulse pairs, newest in bit 0; all 0: they are alike, a tone */
    int32_t first;                         /* pulse sent after the last sample: -1, a pair's first; 0, its second */
    int32_t i_alpha_q15, i_beta_q15;       /* of the last sample */
    int32_t step_alpha_q15, step_beta_q15; /* and their change */
    int32_t sum_d, sum_q;                  /* of all y_d, and of all y_q + k y_d; they wrap */
    /* inputs */
    int32_t v_steps;   /* the voltage; 0: none */
    int32_t turned;    /* 0, or -1: a voltage shows at the next sample but one, or at the next */
    int32_t silent;    /* 1: only whole pairs respond; 0: each sample does */
    int32_t cross_q15; /* k */
    int32_t rad_q8;    /* Q15 of radians by LSB of response, 0: no tracking */
    /* the slow loop's */
    int32_t track;          /* gain of the tracking loop, 0: no tracking */
    int32_t full_rad_q8;    /* rad_q8 with all of the voltage */
    int32_t share_q8;       /* share of the voltage used: current control needs the rest */
    int32_t last_d, last_q; /* the sums when last taken */
};

/* The next bit is the sum of these two. The seed is the golden ratio's bits: any but zero would do. */
#define INJECTION_TAP      27
#define INJECTION_LAST_TAP 30
#define INJECTION_SEED     0x4F1BBCDCu

/* Responses, summed over the samples of some milliseconds. */
struct injection_response {
    int32_t d, q;
};

struct current_loop;

/* Resets: pulses of the tuning's voltage, no tracking. Slow loop, before LOOP_INJECTION is chosen. */
void injection_reset(volatile struct current_loop *c, const struct tuning *t);

/* The sums since the last call. Slow loop, each millisecond. */
struct injection_response injection_take(volatile struct current_loop *c);

/* Before LOOP_INJECTION takes over from the observer: restarts the voltage with a new pair. Slow loop. */
void injection_resume(volatile struct current_loop *c);

/* Starts tracking the angle at `angle_q32`; `radian` is G, 128 at least. Slow loop, before injection_follow(). */
void injection_track(volatile struct current_loop *c, const struct tuning *t, uint32_t angle_q32, int32_t radian);

/* The voltage left for the wave by v_d, relative to the wave, Q8: below 256 the wave is reduced. Slow loop. */
int32_t injection_room_q8(const volatile struct current_loop *c, const struct tuning *t);

/* Voltage, cross saturation and gains of the tracking loop for the present bus voltage and current. Slow loop, every ms. */
void injection_follow(volatile struct current_loop *c, const struct tuning *t);

#endif
