/* SPDX-License-Identifier: MIT */
/*
 * Measures the direction of the EMF with the bridge off and without a voltage sensor: the low sides short the windings for some
 * microseconds, and the current is sampled at the end. It points along minus the EMF in the middle of the pulse, for any
 * inductance, flux and pulse length:
 *
 *     i = -e T / L,    T far below L / R and a turn
 *
 * The pulse is within the interval in which the low sides conduct, just before the sample in its middle: no leg switches, so
 * dead time does not distort it. Its length is timed by the carrier. If it is too short for a slow winding, one of a whole
 * period follows, from sample to sample: there the dead-time error is along the current, within 30 degrees. Source of the
 * equation: the voltage equation of a winding without current.
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
 * One pulse of `counts`, EMF_PULSE_MIN to the longest; starts in the present PWM period or the next and has ended on return.
 * Takes up to two periods; masks all interrupts for a quarter of one at most. Slow loop, bridge off, the legs at half on-time
 * (integrals of 0). While a fault is latched there is no pulse: the sample is with the bridge off.
 */
struct emf_pulse emf_pulse(const volatile struct current_loop *c, struct fabric *f, uint32_t counts);

/* The same for a whole PWM period of `samples` samples. */
struct emf_pulse emf_pulse_period(const volatile struct current_loop *c, struct fabric *f, uint32_t samples);

/* Waits for this many samples. Slow loop. */
void emf_pulse_wait(const struct fabric *f, uint32_t samples);

/* ==== bursts, bridge on ==== */

/*
 * A burst: a square wave of voltage along one angle, fast enough for any winding, with every sample of the current response.
 * The slow loop waits sample by sample, three quarters of a millisecond at most; the current loop's interrupt runs as usual and
 * outputs the voltages in its integrals.
 *
 * The wave is + - - +, repeated. The current then goes up, back, down and back: voltage and current are orthogonal, so to first
 * order resistance does not affect the inductance from a regression of current changes on voltage; the rest is compensated
 * (identify_inductance.c).
 *
 * The dead-time error depends on the signs of the phase currents. So a burst is on top of a constant current, large enough that
 * no phase changes sign: then that error is constant, and no part of the response.
 */

/* Voltages in a burst: whole waves, with room in the millisecond for the samples after them and the rest of the slow loop. */
#define BURST_LENGTH (CONFIG_PERIODS_PER_SLOW >= 16 ? CONFIG_PERIODS_PER_SLOW * 3 / 5 / 4 * 4 : 4)

/* A voltage chosen after one sample enters the computation at the next and acts from the one after (PWM_UPDATE_VALLEY). */
#define BURST_LAG 2

#define BURST_SAMPLES (BURST_LENGTH + BURST_LAG + 1)

struct burst {
    uint32_t field_q32; /* the frame of the steady current */
    uint32_t angle_q32; /* direction of the wave */
    int32_t v_steps;    /* its amplitude, in the loop's steps */
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
 * Plays the burst and keeps the samples. LOOP_FORCED is the source, with one sample a period that acts at the valley. Meanwhile
 * the controllers' gains are zero: their integrals hold the voltage, with the wave on top. Slow loop, bridge on.
 */
void burst_play(struct burst *b, volatile struct current_loop *c, const struct adc_regs *adc);

/* Maximum amplitude of a wave on top of the present voltages, without clipping. */
int32_t burst_room_steps(const volatile struct current_loop *c);

/* Maximum excursion of the current along the wave. Slow loop. */
int32_t burst_peak_q15(const struct burst *b);

/* Adds the burst's samples to the sums. Slow loop. */
void burst_add(struct burst_sums *s, const struct burst *b, int32_t vbus_q15);

#endif
