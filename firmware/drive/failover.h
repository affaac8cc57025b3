/* SPDX-License-Identifier: MIT */
/*
 * Failover from encoder or Hall switches to the observer (source/sensorless.h), if that is the selected reaction to their
 * fault; the fault is then a warning until the next `on`. The drive does not return to the sensor by itself.
 *
 *   seed      the rotor's angle from what is still valid (encoder_watch_seed(), lock_watch.h): the angle predicted
 *             from good counts or edges; or the last good angle, and the speed since; or the direction of the EMF if there
 *             is enough of it
 *   bridge    stays on: the frame turns to the seed, voltages and currents are expressed in it, and the vector changes to the
 *             observer's handler, all in one masked section. If the interrupt found the fault, the frame keeps turning at its
 *             speed until the slow loop comes, a millisecond at most
 *   or off    if the wrong angle has already caused an over-current trip: once the current has decayed, the gates switch on
 *             again. The PWM already outputs the EMF of the seed then, so there is no current step
 *
 * Conditions: speed or torque control, an observability margin of 4.5, no field weakening. Otherwise, or if the observer later
 * loses the rotor, the sensor's fault is latched: a controlled stop if its class allows one, else off.
 */
#ifndef FIRMWARE_DRIVE_FAILOVER_H
#define FIRMWARE_DRIVE_FAILOVER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/fault/fault.h"

struct axis;

struct failover {
    volatile uint32_t cause;   /* enum fault that caused the failover; FAULT_NONE: none */
    volatile uint32_t pending; /* enum fault found in the interrupt; the slow loop continues from `seed` */
    uint32_t waited_ms;
    struct rotor_seed seed;
};

/* Clears it. Slow loop, at `on`. */
void failover_reset(struct axis *a);

/*
 * A sample shows an encoder fault, or an over-current blamed on encoder or switches: continues from the seed, or switches the
 * bridge off until the slow loop turns it on again. False, without effect, if failover is not allowed. The current loop's ISR,
 * cold.
 */
bool failover_from_sample(struct axis *a, enum fault cause);

/*
 * An over-current while a failover is pending still comes from the wrong angle: the bridge is off until it has decayed, as
 * above. False if none is pending, or the bridge is off already. The current loop's ISR, cold.
 */
bool failover_absorbs_trip(struct axis *a);

/* The slow loop's part; may raise the fault. Slow loop, while one is pending. */
void failover_step(struct axis *a);

/* The slow loop found the fault, bridge on: the observer takes over. False, without effect, if not allowed. Slow loop. */
bool failover_begin(struct axis *a, enum fault cause);

/* The cause to report for a fault after a failover: the sensor's, if the observer has lost the rotor. Any context. */
enum fault failover_blame(const struct axis *a, enum fault seen);

#endif
