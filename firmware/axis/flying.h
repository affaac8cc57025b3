/* SPDX-License-Identifier: MIT */
/*
 * Flying start: without an encoder, and without a voltage sensor, whether the rotor turns when the drive is switched on, and
 * where it is. In this order, so that no step makes more than a tenth of rated torque:
 *
 *   pulses        of some microseconds (commission/emf_pulse.h), the bridge off in between, twice as long each until 3 % of
 *                 the largest current flows. Two within a quarter of a millisecond tell the speed, the next ones track it
 *   no current    where the longest shows next to nothing the EMF is so small that the current loop may be switched on and
 *                 regulate currents of 0. Its voltages are the EMF then, and are tracked likewise
 *   and on        the observer begins with that angle, that speed, and the voltages that belong to them; the gates open behind
 *                 a sample, when the legs play these voltages already. The speed loop goes on from that speed
 *
 * Where neither shows a rotor that turns, it stands or nearly so, and the start is the one from standstill.
 */
#ifndef FIRMWARE_AXIS_FLYING_H
#define FIRMWARE_AXIS_FLYING_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/emf_track.h"

struct axis;

enum flying_result {
    FLYING_SEARCHES,
    FLYING_CAUGHT, /* the observer leads */
    FLYING_STANDS, /* nothing turns fast enough to be seen; the bridge may be on, and no current flows */
};

struct flying {
    uint32_t ms;
    uint32_t quiet;  /* looks that showed nothing */
    uint32_t counts; /* of a pulse */
    bool regulates;  /* the second step */
    struct emf_track track;
};

/* Slow loop, bridge off, zero of the sensors known. */
void flying_begin(struct axis *a);

/* One step a millisecond; the first part of the search takes up to half of it. May raise a fault instead. Slow loop. */
enum flying_result flying_step(struct axis *a);

/*
 * Somebody knows that the rotor is at this angle at the next sample, and turns so: the observer leads it 3 samples later. Slow
 * loop, bridge off, LOOP_OBSERVER.
 */
void flying_go_on(struct axis *a, uint32_t angle_q32, int32_t speed_q32);

#endif
