/* SPDX-License-Identifier: MIT */
/*
 * The rotor's angle and speed without an encoder: a flux observer for machines with magnets, salient or not.
 *
 * The flux linkage is integrated from the voltages that were realised, psi' = u - R i, in the frame of the stator. In the frame
 * of the rotor as it is believed to stand the currents tell what the flux should be, L i + psi_f. The difference e is looked
 * at along the active flux psi_a = psi_f + (L_d - L_q) i* (of machines that are not salient the magnets' alone):
 *
 *     rho + j nu = e psi_a* / |psi_a|^2
 *
 * nu is the error of the angle, which a tracking loop of two integrators takes away; rho is an error of length and is put
 * back into the flux along psi_a, 2 sigma rho psi_a: what else an integrator would collect, offsets and all, fades with sigma.
 * Only sigma lets errors of R, of psi_f and of the voltage turn the angle. Sources: Hinkkanen, Saarakkala, Awan, Moelsae,
 * Tuovinen, "Observers for sensorless synchronous motor drives: framework for design and analysis", IEEE Trans. Ind. Appl.
 * 54(6), 2018; the steady error's formula is held by tests/unit/test_observer.py:
 *
 *     sin(error) = 2 sigma / w (psi_told / psi - cos(error) - (R - R_told) i_q / (w psi)) + (R - R_told) i_d / (w psi)
 *
 * Whether there is enough to see says the margin m = |w| psi_a / (dR |i| + dU): the EMF by what a wrong R and the dead time
 * may hide. With the gains below the angle holds down to about 1.5.
 *
 * Formats. Flux: Q28 of the tuning's flux unit, in which no flux of this motor below i_range reaches 1.0; "flux 14" is its
 * upper 18 bits. Voltages in steps and currents in Q15 as in the current loop; rho, nu Q15, saturated to +-1.0 (radians).
 */
#ifndef FIRMWARE_CONTROL_OBSERVER_H
#define FIRMWARE_CONTROL_OBSERVER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/tuning.h"

/*
 * What may hide the EMF: 15 % of R, which the start has measured and which rises so much with 38 K; and of dead time what its
 * compensation leaves, a 256th of the bus.
 */
#define OBSERVER_DOUBT_R_Q8      38
#define OBSERVER_DOUBT_BUS_SHIFT 8

/* More than this the flux is not: the unit, either component. */
#define OBSERVER_FLUX_BITS  29
#define OBSERVER_FLUX_SHIFT 14 /* from the flux to flux 14 */

/* Of the gains; the interrupt's products stay within 32 bits. */
#define OBSERVER_ALONG_ONE  (1 << 25) /* along: this by psi_a in flux 14 */
#define OBSERVER_ALONG_MOST 16384
#define OBSERVER_TRACK_MOST 4096

struct observer {
    /* the interrupt's */
    int32_t flux_alpha, flux_beta;       /* for the next sample */
    int32_t v_alpha_steps, v_beta_steps; /* that answered the last one */
    int32_t rho_q15;
    /* what it is given */
    int32_t of_newest, of_older;  /* flux by a step: of the voltage that answers a sample, and of the one before */
    int32_t r_q5;                 /* flux by current */
    int32_t magnet, lq, saliency; /* flux 14: psi_f; of a current of 1.0 by L_q, and by L_q - L_d */
    int32_t along_d, along_q;     /* psi_a / |psi_a|^2 */
    int32_t back_d, back_q;       /* 2 sigma Ts psi_a, times a power of two: */
    uint32_t back_shift;
    int32_t track; /* gains of the tracking loop: of a Q15 of radians to Q32 of a turn */
    int32_t track_speed_q8;
    /* the slow loop's */
    int32_t active;           /* |psi_a|, flux 14 */
    int32_t margin_q8;        /* m; 255 at most */
    int32_t margin_torque_q8; /* what it would be with i_q alone, or without any */
    int32_t i_q4, i_q_q4;     /* |i| and |i_q|, smoothed */
    int32_t calm_q24;         /* by so much the tracking loop is slower after a hand-over, in |w| */
};

/* How the observer is to behave. */
enum observer_role {
    OBSERVER_FOLLOWS, /* the speed is told, it finds the angle: the field is prescribed */
    OBSERVER_LEADS,   /* it finds both */
    OBSERVER_RESTS,   /* it does not run: the margin alone */
};

struct current_loop;

/* The rotor stands at `angle_q32`, with this current along its magnets. Its speed stays as it is told. Slow loop. */
void observer_reset(volatile struct current_loop *c, const struct tuning *t, uint32_t angle_q32, int32_t i_d_q15);

/* The flux as it has to be at the angle that is believed, with the present currents. Slow loop, before LOOP_OBSERVER leads. */
void observer_preset(volatile struct current_loop *c, const struct tuning *t);

/* From this margin on it may lead. */
#define OBSERVER_LEADS_Q8 (45 * 256 / 10)

/*
 * The margin that an observer would have of a rotor at this speed, with magnets alone and these currents: what it has, or less.
 * Slow loop.
 */
int32_t observer_margin_q8(const struct tuning *t, int32_t i_q15, int32_t w_q15, int32_t vbus_q15);

/* As observer_follow() where it is to lead at once: what is smoothed begins with the present currents. Slow loop. */
void observer_begin(volatile struct current_loop *c, const struct tuning *t);

/*
 * It is about to lead a rotor whose angle was known until now. What the flux begins with is not quite what it would come to,
 * and the difference goes round once a turn until sigma has taken it away: a slow tracking loop, for two turns, tells the
 * speed loop little of that. Slow loop, before observer_begin().
 */
void observer_calm(volatile struct current_loop *c);

/* The double pole of its tracking loop at most, in |w|, Q8. Any context. */
int32_t observer_quickest_q8(const struct tuning *t);

/* Gains for the present bus voltage, speed and currents, and the margin. Slow loop, every millisecond. */
void observer_follow(volatile struct current_loop *c, const struct tuning *t, enum observer_role role);

#endif
