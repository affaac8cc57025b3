/* SPDX-License-Identifier: MIT */
/*
 * The rotor's angle and speed without an encoder: a flux observer for machines with magnets, salient or not.
 *
 * The flux linkage is integrated from the realised voltages, psi' = u - R i, in the stator frame. In the estimated rotor frame
 * the currents give the expected flux, L i + psi_f. The difference e is resolved along the active flux
 * psi_a = psi_f + (L_d - L_q) i* (the magnets' alone in non-salient machines):
 *
 *     rho + j nu = e psi_a* / |psi_a|^2
 *
 * nu is the angle error, which a tracking loop of two integrators removes; rho is an error of length and is fed back into the
 * flux along psi_a, 2 sigma rho psi_a: integrator drift, as from offsets, decays with sigma. Only sigma lets errors of R, of
 * psi_f and of the voltage turn the angle. Sources: Hinkkanen, Saarakkala, Awan, Moelsae, Tuovinen, "Observers for sensorless
 * synchronous motor drives: framework for design and analysis", IEEE Trans. Ind. Appl. 54(6), 2018; tests/unit/test_observer.py
 * checks the formula for the steady error:
 *
 *     sin(error) = 2 sigma / w (psi_nominal / psi - cos(error) - (R - R_nominal) i_q / (w psi)) + (R - R_nominal) i_d / (w psi)
 *
 * The margin m = |w| psi_a / (dR |i| + dU) shows whether there is enough signal: the EMF relative to the uncertainty by R and
 * dead time. With the gains below the angle holds down to about 1.5.
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
 * Uncertainty of the EMF: 15 % of R, which is measured at the start and increases by that with 38 K; and the residual dead-time
 * error, 1/256 of the bus.
 */
#define OBSERVER_R_UNCERTAINTY_Q8      38
#define OBSERVER_BUS_UNCERTAINTY_SHIFT 8

/* The flux range: the unit, either component. */
#define OBSERVER_FLUX_BITS  29
#define OBSERVER_FLUX_SHIFT 14 /* from the flux to flux 14 */

/* Gain limits; the interrupt's products stay within 32 bits. */
#define OBSERVER_ALONG_ONE (1 << 25) /* along: this by psi_a in flux 14 */
#define OBSERVER_ALONG_MAX 16384
#define OBSERVER_TRACK_MAX 4096

struct observer {
    /* the interrupt's */
    int32_t flux_alpha, flux_beta;       /* for the next sample */
    int32_t v_alpha_steps, v_beta_steps; /* output after the last one */
    int32_t rho_q15;
    /* inputs */
    int32_t of_newest, of_older;  /* flux per step: of the voltage output after a sample, and of the one before */
    int32_t r_q5;                 /* flux by current */
    int32_t magnet, lq, saliency; /* flux 14: psi_f; L_q and L_q - L_d times a current of 1.0 */
    int32_t along_d, along_q;     /* psi_a / |psi_a|^2 */
    int32_t back_d, back_q;       /* 2 sigma Ts psi_a, times a power of two: */
    uint32_t back_shift;
    int32_t track; /* gains of the tracking loop: from radians Q15 to turns Q32 */
    int32_t track_speed_q8;
    /* the slow loop's */
    int32_t active;           /* |psi_a|, flux 14 */
    int32_t margin_q8;        /* m; 255 at most */
    int32_t margin_torque_q8; /* the same with i_q alone, or without it */
    int32_t i_q4, i_q_q4;     /* |i| and |i_q|, smoothed */
    int32_t slow_down_q24;    /* reduction of the tracking loop's pole after a hand-over, in |w| */
};

/* The observer's role. */
enum observer_role {
    OBSERVER_FOLLOWS, /* the speed is given (I-f control); it estimates the angle */
    OBSERVER_LEADS,   /* it estimates both */
    OBSERVER_RESTS,   /* inactive: margin only */
};

struct current_loop;

/* Starts at `angle_q32`, with this current along the magnets. The speed stays as given. Slow loop. */
void observer_reset(volatile struct current_loop *c, const struct tuning *t, uint32_t angle_q32, int32_t i_d_q15);

/* Sets the flux for the estimated angle and the present currents. Slow loop, before LOOP_OBSERVER is selected. */
void observer_preset(volatile struct current_loop *c, const struct tuning *t);

/* From this margin on it may give the angle. */
#define OBSERVER_LEADS_Q8 (45 * 256 / 10)

/* The margin an observer would have at this speed and current, from the magnets alone: the actual margin or less. Slow loop. */
int32_t observer_margin_q8(const struct tuning *t, int32_t i_q15, int32_t w_q15, int32_t vbus_q15);

/* As observer_follow(), to start immediately: filtered values start from the present currents. Slow loop. */
void observer_begin(volatile struct current_loop *c, const struct tuning *t);

/*
 * Prepares a hand-over from a known angle. The flux starts slightly off its steady-state value, and the difference rotates once
 * a turn until sigma removes it: a slower tracking loop, for two turns, keeps most of it from the speed loop. Slow loop, before
 * observer_begin().
 */
void observer_slow_down(volatile struct current_loop *c);

/* The fastest double pole of its tracking loop, in |w|, Q8. Any context. */
int32_t observer_quickest_q8(const struct tuning *t);

/* Gains for the present bus voltage, speed and currents, and the margin. Slow loop, every millisecond. */
void observer_follow(volatile struct current_loop *c, const struct tuning *t, enum observer_role role);

#endif
