/* SPDX-License-Identifier: MIT */
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
#ifndef FIRMWARE_COMMISSION_IDENTIFY_BURST_H
#define FIRMWARE_COMMISSION_IDENTIFY_BURST_H

#include <stdint.h>

#include "drivers/fabric/adc.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/config.h"

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
