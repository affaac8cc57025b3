/* SPDX-License-Identifier: MIT */
/*
 * Flying start: finds, without an encoder or a voltage sensor, whether the rotor turns at switch-on, and where it is. The order
 * keeps every step below a tenth of rated torque:
 *
 *   pulses        of some microseconds (commission/emf_pulse.h), bridge off in between, each twice as long as the last until
 *                 3 % of the largest current flows. Two within a quarter of a millisecond give the speed, the next track it
 *   no current    if the longest pulse shows next to nothing, the EMF is small enough to switch the current loop on and
 *                 regulate to zero current. Its voltages are then the EMF, and are tracked the same way
 *   and on        the observer begins with that angle, that speed, and the matching voltages; the gates open right after a
 *                 sample, when the PWM already outputs these voltages. The speed loop goes on from that speed
 *
 * If neither shows a turning rotor, it is at or near standstill, and the start is the one from standstill.
 */
#ifndef FIRMWARE_SOURCE_FLYING_H
#define FIRMWARE_SOURCE_FLYING_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/emf_track.h"

struct axis;

enum flying_result {
    FLYING_SEARCHES,
    FLYING_CAUGHT, /* the observer leads */
    FLYING_STANDS, /* turns too slowly to be seen, if at all; the bridge may be on, with no current */
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
 * The caller knows the rotor's angle at the next sample, and its speed: the observer leads 3 samples later. Slow loop, bridge
 * off, LOOP_OBSERVER.
 */
void flying_resume(struct axis *a, uint32_t angle_q32, int32_t speed_q32);

#endif
