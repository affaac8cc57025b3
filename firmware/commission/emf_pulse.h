/* SPDX-License-Identifier: MIT */
/*
 * Whether a rotor turns whose bridge is off, and where it is, without a voltage sensor: the low sides short the windings for
 * some microseconds, and the current that the magnets drive meanwhile is sampled at the end of it. It has the direction of
 * minus the EMF as it was in the middle of the pulse, whatever inductance, flux and length there are:
 *
 *     i = -e T / L,    T far below L / R and a turn
 *
 * The pulse lies in the time in which the low sides conduct anyway, just before the sample in the middle of it: no leg
 * switches, so that no dead time falsifies it. Its length goes by the carrier, not by the processor's clock. One that is too
 * short for a sluggish winding is followed by one of a whole period, from sample to sample: what dead time takes of it lies
 * along the current, to 30 degrees. Source of the equation: the voltage equation of a winding without current.
 */
#ifndef FIRMWARE_COMMISSION_EMF_PULSE_H
#define FIRMWARE_COMMISSION_EMF_PULSE_H

#include <stdint.h>

#include "drivers/fabric/fabric.h"
#include "lib/transform_q15.h"

/* Clocks of the fabric: the shortest pulse, in which an amplifier of 1 MHz settles. */
#define EMF_PULSE_SHORTEST 100u

struct emf_pulse {
    uint32_t sequence; /* of the sample (adc.h) */
    alphabeta_t i;     /* Q15, in the frame of the stator */
};

/* The longest pulse between two edges, clocks. Any context. */
uint32_t emf_pulse_longest(const struct pwm_regs *pwm);

/*
 * One pulse of `counts`, EMF_PULSE_SHORTEST to the longest, that begins in the present PWM period or the next and is over when
 * this returns. Takes up to two periods; holds all interrupts back for a quarter of one at most. Slow loop, bridge off, the
 * legs at half on-time (integrals of 0).
 */
struct emf_pulse emf_pulse(struct fabric *f, uint32_t counts);

/* The same for a whole PWM period, of so many samples. */
struct emf_pulse emf_pulse_period(struct fabric *f, uint32_t samples);

/* Lets so many samples pass. Slow loop. */
void emf_pulse_wait(const struct fabric *f, uint32_t samples);

#endif
