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
#ifndef FIRMWARE_COMMISSION_PULSES_H
#define FIRMWARE_COMMISSION_PULSES_H

#include <stdint.h>

#include "drivers/fabric/adc.h"
#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/config.h"
#include "lib/transform_q15.h"

struct current_loop;

/* Fabric clocks: the shortest pulse, in which a 1 MHz amplifier settles. */
#define EMF_PULSE_MIN 100u

struct emf_pulse {
    uint32_t sequence; /* of the sample (adc.h) */
    alphabeta_t i;     /* Q15, in the stator frame */
};

/* The longest pulse between two edges, clocks. Any context. */
uint32_t emf_pulse_longest(const struct pwm_regs *pwm);

/*
 * One pulse of `counts`, EMF_PULSE_MIN to the longest; begins in the present PWM period or the next and is over on return.
 * Takes up to two periods; masks all interrupts for a quarter of one at most. Slow loop, bridge off, the legs at half on-time
 * (integrals of 0). While a fault is latched no pulse comes: the sample is that of an open bridge.
 */
struct emf_pulse emf_pulse(const volatile struct current_loop *c, struct fabric *f, uint32_t counts);

/* The same for a whole PWM period of `samples` samples. */
struct emf_pulse emf_pulse_period(const volatile struct current_loop *c, struct fabric *f, uint32_t samples);

/* Waits for this many samples. Slow loop. */
void emf_pulse_wait(const struct fabric *f, uint32_t samples);

/* ==== bursts, bridge on ==== */

/*
 * A burst: a square wave of voltage along one angle, fast enough for any winding, with every sample of the current response.
 * The slow loop stays in its step for it, three quarters of a millisecond at most, and waits sample by sample; the current
 * loop's interrupt runs on as usual and turns the voltages held in its integrals into compares.
 *
 * The wave is + - - +, repeated. The current then goes up, back, down and back: the voltage is orthogonal to it, so to first
 * order resistance does not shift the inductance that a regression of current changes on voltage finds; the rest is known
 * (identify_inductance.c).
 *
 * Dead time acts by the signs of the phase currents. So a burst rides on a steady current large enough that no phase changes
 * sign: then dead time is constant, and no part of the wave.
 */

/* Voltages in a burst: whole waves, with room in the millisecond for the samples after them and the rest of the slow loop. */
#define BURST_LENGTH (CONFIG_PERIODS_PER_SLOW >= 16 ? CONFIG_PERIODS_PER_SLOW * 3 / 5 / 4 * 4 : 4)

/* A voltage chosen after one sample enters the computation at the next and acts from the one after (PWM_UPDATE_VALLEY). */
#define BURST_LAG 2

#define BURST_SAMPLES (BURST_LENGTH + BURST_LAG + 1)

struct burst {
    uint32_t field_q32; /* the frame of the steady current */
    uint32_t angle_q32; /* direction of the wave */
    int32_t v_steps;    /* its height, in the loop's steps */
    int32_t hold;       /* samples per quarter of the wave: 1, or BURST_LENGTH / 4 */
    int32_t turn_q32;   /* rotation of frame and angle per sample: the rotor's, or 0 */
    int16_t i_d_q15[BURST_SAMPLES], i_q_q15[BURST_SAMPLES]; /* along the angle and across it */
};

/* Sums for a regression of the current change between two samples on the wave's sign and the previous current. */
struct burst_sums {
    int32_t count;      /* of changes */
    int32_t ui, ud, uq; /* sign times current, times change along, times change across */
    int64_t ii, id;     /* current squared, current times change along */
    int64_t vbus_q15;   /* sum over the bursts */
    int32_t bursts;
};

/* The sign of the wave at place k: +1 or -1. Any context. */
int32_t burst_sign(const struct burst *b, int32_t k);

/*
 * Plays the burst and keeps the samples. LOOP_FORCED is the source, with one sample a period that acts at the valley.
 * Meanwhile the controllers rest: their integrals stay as they are, with the wave on top. Slow loop, bridge on.
 */
void burst_play(struct burst *b, volatile struct current_loop *c, const struct adc_regs *adc);

/* How high a wave on top of the voltages held now may be: one that is clipped is not what it is taken for. */
int32_t burst_room_steps(const volatile struct current_loop *c);

/* The largest excursion of the current along the wave. Slow loop. */
int32_t burst_peak_q15(const struct burst *b);

/* Adds the burst's samples to the sums. Slow loop. */
void burst_add(struct burst_sums *s, const struct burst *b, int32_t vbus_q15);

#endif
