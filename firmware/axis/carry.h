/* SPDX-License-Identifier: MIT */
/*
 * Carrying on without encoder or Hall switches, where that is chosen for their fault: the observer leads from now on
 * (axis/sensorless.h), and the fault is a warning until the next `on`. The drive does not go back to the sensor by itself.
 *
 *   seed      where the rotor is, from what can still be trusted (supervise_encoder_seed(), hall_watch.h): the angle predicted
 *             from good counts or edges; or the last good angle, and the speed since; or the direction of the EMF where there
 *             is enough of it
 *   bridge    stays on: the frame turns to the seed, voltages and currents are expressed in it, and the vector changes to the
 *             observer's handler in the same masked moment. Found in the interrupt, the frame turns on at its speed until
 *             the slow loop comes, a millisecond at most
 *   or off    if the wrong angle has already tripped the current: once that has faded, the legs play the EMF of the seed
 *             before the gates open again
 *
 * It needs control of speed or torque, a margin of observability of 4.5, and an unweakened field. Otherwise, and where the
 * observer later loses the rotor, it is the sensor's fault after all: a controlled stop where its class allows one, else off.
 */
#ifndef FIRMWARE_AXIS_CARRY_H
#define FIRMWARE_AXIS_CARRY_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/axis/fault.h"

struct axis;

/* Where the rotor was at an instant of the encoder's clock, and how it has turned since. */
struct rotor_seed {
    uint32_t angle_q32;
    uint32_t clock;
    int32_t speed_q32; /* a sample */
};

struct carry {
    volatile uint32_t cause; /* enum fault: since this without the sensor; FAULT_NONE: not so */
    volatile uint32_t waits; /* enum fault: found in the interrupt, the slow loop has to go on from `seed` */
    uint32_t waited_ms;
    struct rotor_seed seed;
};

/* Nothing has happened. Slow loop, at `on`. */
void carry_begin(struct axis *a);

/*
 * A sample has a fault of the encoder, or an over-current that is blamed on encoder or switches: goes on by the seed, or
 * switches the bridge off until the slow loop has it on again. False where it may not: nothing has changed. ISR, the current
 * loop's, cold.
 */
bool carry_from_sample(struct axis *a, enum fault cause);

/*
 * An over-current while the frame turns by itself is one that the wrong angle has made, and only now passes the trip: the
 * bridge is off until it has faded, as above. False where nothing waits, or it is off already. ISR, the current loop's,
 * cold.
 */
bool carry_bears_trip(struct axis *a);

/* The slow loop's part of that; may raise the fault. Slow loop, while `waits`. */
void carry_step(struct axis *a);

/* The slow loop has found it, bridge on: the observer leads. False where it may not: nothing has changed. Slow loop. */
bool carry_take_over(struct axis *a, enum fault cause);

/* What a fault is, that comes while the drive carries on: the sensor's, if the observer has lost the rotor. Any context. */
enum fault carry_blame(const struct axis *a, enum fault seen);

#endif
