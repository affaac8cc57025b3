/* SPDX-License-Identifier: MIT */
/*
 * The rotor's angle from its saliency, at any speed that is not high: pulses of voltage along the axis in which the magnets
 * are believed, each second one the first's opposite, and what current answers across it. Sources: Kim, Ha, Sul,
 * "PWM switching frequency signal injection sensorless method in IPMSM", IEEE Trans. Ind. Appl. 48(5), 2012; saturation across
 * the axes: Guglielmi, Pastorelli, Vagati, IEEE Trans. Ind. Appl. 42(6), 2006.
 *
 * From a sample to the next the voltage s U, s = +-1, changes the current by s U T Y, where Y is the inverse of the incremental
 * inductances. The change from the last change takes out whatever is steady or grows steadily; both are of one sign after
 * multiplication with s:
 *
 *     y_d = s (i_d - 2 i_d' + i_d'') = 2 U T (Y0 + Y1 cos 2(m - a)),    Y0, Y1 = (1 / Ld +- 1 / Lq) / 2
 *     y_q = s (i_q - 2 i_q' + i_q'') = 2 U T Y1 sin 2(m - a)
 *
 * with the magnets at m and the voltage along a. Where the iron saturates, L_dq turns the axis of this by up to ten degrees;
 * y_q + k y_d with k = L_dq / L_qq is zero on the magnets' axis for any Ld. So the angle is ahead by
 *
 *     nu = -(y_q + k y_d) / G,    G = 4 U T Y1, measured at the start
 *
 * which the tracking loop of the flux observer takes away (stage_flux.h): two integrators, with a double pole at 60 Hz or
 * less: as quick as a load by step asks for, and slower where little answers to a degree, for the sensors' noise is the same.
 *
 * Two variants, one interrupt:
 *
 *   tone    all pairs of pulses are alike, so the sign is another one each sample, and current swings by +-U T Y / 2 at half
 *           the sampling rate, which is heard. Each sample answers. The controllers see the mean of two samples: the ripple is
 *           not in it
 *   silent  the sign of each pair is the newest bit of a register that is fed back, x^31 + x^28 + 1: the pairs are as good as
 *           drawn, 2^31 - 1 of them before they repeat, half of them each way up to one. Each pair takes back what it did, so
 *           current walks nowhere; between pairs it is at rest, by +-U T Y off within them. Its spectrum has no line. A pair
 *           answers once, where it ends, and counts twice: the sums are as large. The controllers see the samples between
 *           pairs, each of them twice. White noise s of the sensors turns the angle by sqrt(3 / 4) of what it does by
 *           tone: n samples of tone sum to 2 n U T Y beside 4 s sqrt(n), n / 2 pairs to the same beside 2 s sqrt(6 n / 2)
 *
 * One of zeros stays one of zeros: the tone is the same register with nothing in it.
 *
 * Formats: currents Q15; responses y likewise, LSB; voltages in steps; nu Q15, radians.
 */
#ifndef FIRMWARE_CONTROL_INJECTION_H
#define FIRMWARE_CONTROL_INJECTION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/tuning.h"

/* Ends of the ranges of what the interrupt is given: its products stay within 32 bits. */
#define INJECTION_V_MOST_STEPS 12288 /* 30 % of the bus */
#define INJECTION_CROSS_MOST   8191
#define INJECTION_RAD_MOST_Q8  65535

struct injection {
    /* the interrupt's */
    uint32_t signs;                  /* of the pairs of pulses, the newest in bit 0; all 0: they are alike, a tone */
    int32_t first;                   /* what answered the last sample: -1, a pair's first pulse; 0, its second */
    int32_t i_alpha_q15, i_beta_q15; /* of the last sample */
    int32_t step_alpha_q15, step_beta_q15; /* and what they had changed by */
    int32_t sum_d, sum_q;                  /* of all y_d, and of all y_q + k y_d; they wrap */
    /* what it is given */
    int32_t v_steps;   /* the voltage; 0: there is none */
    int32_t turned;    /* 0, or -1: the sample that shows a voltage is the next but one, or the next */
    int32_t silent;    /* 1: only whole pairs answer; 0: each sample does */
    int32_t cross_q15; /* k */
    int32_t rad_q8;    /* Q15 of radians by LSB of response, 0: nothing tracks */
    /* the slow loop's */
    int32_t track;          /* gain of the tracking loop, 0: nothing tracks */
    int32_t full_rad_q8;    /* rad_q8 with all of the voltage */
    int32_t share_q8;       /* of the voltage: the rest is needed for the current */
    int32_t last_d, last_q; /* the sums when they were last taken */
};

/* The next bit is the sum of these two. It begins with the golden ratio's bits: any but zero would do. */
#define INJECTION_TAP      27
#define INJECTION_LAST_TAP 30
#define INJECTION_SEED     0x4F1BBCDCu

/* Responses, summed over the samples of some milliseconds. */
struct injection_seen {
    int32_t d, q;
};

struct current_loop;

/* Nothing is known yet: pulses of the tuning's voltage, nothing tracks. Slow loop, before LOOP_INJECTION is chosen. */
void injection_reset(volatile struct current_loop *c, const struct tuning *t);

/* The sums since it was last asked. Slow loop, each millisecond. */
struct injection_seen injection_take(volatile struct current_loop *c);

/* Before LOOP_INJECTION takes over from the observer: the voltage begins anew, with a pair. Slow loop. */
void injection_resume(volatile struct current_loop *c);

/* From here on the angle is tracked, from `angle_q32`; `radian` is G, 128 at least. Slow loop, before injection_follow(). */
void injection_track(volatile struct current_loop *c, const struct tuning *t, uint32_t angle_q32, int32_t radian);

/* The room that v_d leaves for the wave, in waves, Q8: below 256 it is made smaller. Slow loop. */
int32_t injection_room_q8(const volatile struct current_loop *c, const struct tuning *t);

/* Voltage, cross saturation and gains of the tracking loop for the present bus voltage and current. Slow loop, every ms. */
void injection_follow(volatile struct current_loop *c, const struct tuning *t);

#endif
