/* SPDX-License-Identifier: MIT */
/*
 * Finds, bridge off and without a voltage sensor, whether the rotor turns, and where it is: the low sides short the windings
 * for some microseconds, and the current that the magnets drive is sampled at the end. It points along minus the EMF in the
 * middle of the pulse, whatever the inductance, flux and pulse length:
 *
 *     i = -e T / L,    T far below L / R and a turn
 *
 * The pulse lies in the time in which the low sides conduct anyway, just before the sample in the middle of it: no leg
 * switches, so dead time does not distort it. The carrier times its length, not the processor's clock. If it is too short for
 * a slow winding, one of a whole period follows, from sample to sample: what dead time takes from it lies along the current,
 * to 30 degrees. Source of the equation: the voltage equation of a winding without current.
 */
#ifndef FIRMWARE_COMMISSION_EMF_PULSE_H
#define FIRMWARE_COMMISSION_EMF_PULSE_H

#include <stdint.h>

#include "drivers/fabric/fabric.h"
#include "lib/transform_q15.h"

struct current_loop;

/* Fabric clocks: the shortest pulse, in which a 1 MHz amplifier settles. */
#define EMF_PULSE_SHORTEST 100u

struct emf_pulse {
    uint32_t sequence; /* of the sample (adc.h) */
    alphabeta_t i;     /* Q15, in the stator frame */
};

/* The longest pulse between two edges, clocks. Any context. */
uint32_t emf_pulse_longest(const struct pwm_regs *pwm);

/*
 * One pulse of `counts`, EMF_PULSE_SHORTEST to the longest; begins in the present PWM period or the next and is over on return.
 * Takes up to two periods; masks all interrupts for a quarter of one at most. Slow loop, bridge off, the legs at half on-time
 * (integrals of 0). While a fault is latched no pulse comes: the sample is that of an open bridge.
 */
struct emf_pulse emf_pulse(const volatile struct current_loop *c, struct fabric *f, uint32_t counts);

/* The same for a whole PWM period of `samples` samples. */
struct emf_pulse emf_pulse_period(const volatile struct current_loop *c, struct fabric *f, uint32_t samples);

/* Waits for this many samples. Slow loop. */
void emf_pulse_wait(const struct fabric *f, uint32_t samples);

#endif
