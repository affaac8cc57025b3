/* SPDX-License-Identifier: MIT */
/*
 * Operation without an encoder. Where the EMF shows the rotor, the flux observer leads (control/observer.h): currents are
 * regulated in its frame, and speed and torque are controlled as ever. Where it does not, a field is prescribed: a current on
 * which the rotor hangs turns as the speed's reference says (I-f, for example Wang, Lu, Zhang: "Sensorless control of PMSM from
 * zero speed by I-f", and every text on synchronous starting): load turns the rotor out of the field by asin(T / T_max), and
 * nothing else tells of it.
 *
 *   start        the field is laid down along three angles, from 90 degrees to 0, for there is no pull from opposite. Voltages
 *                are held, not currents: a winding at a voltage brakes a rotor that swings
 *   field        the observer is held to the field until there is something to see, and then finds the rotor by itself
 *   hand-over    when the margin has been large enough and the rotor calm for 20 ms. The frame is turned to the rotor, and
 *                voltages and currents with it, so that nothing changes; then the current that makes no torque fades
 *   and back     below the smaller margin. The frame is turned so that what the field is to have lies along it, and
 *                the current that is missing grows; torque and speed stay what they were
 */
#ifndef FIRMWARE_AXIS_SENSORLESS_H
#define FIRMWARE_AXIS_SENSORLESS_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

struct sensorless {
    uint32_t ms;        /* of the start, along this angle */
    uint32_t step;      /* of it */
    int32_t v_q23;      /* voltage that is held meanwhile */
    int32_t i_q23;      /* and the current that it drives, smoothed as slowly */
    int32_t v_full_q23; /* both with the whole current */
    int32_t i_full_q23;
    int32_t ref_rpm_q16;       /* the speed's reference a millisecond ago */
    int32_t i_q15;             /* what the field has */
    int32_t lag_q32;           /* by how much the rotor lags behind it, as observed; smoothed */
    int32_t grows_q32;         /* and by how much more from millisecond to millisecond */
    int32_t rest_q32;          /* about which it swings: the same over a longer time */
    bool sees;                 /* the observer has been let go, and these hold */
    uint32_t calm_ms;          /* since when the observer could lead */
    uint32_t weak_ms;          /* since when it should not */
    int32_t extra_q15;         /* d current that makes no torque, left from the field */
    uint32_t lost_ms;          /* since when it contradicts itself */
    uint32_t angle_before_q32; /* the rotor's a millisecond ago (rotor.c) */
};

/* Lays the field down. Slow loop, bridge on, LOOP_OBSERVER. */
void sensorless_begin(struct axis *a);

/* One step a millisecond; true when the rotor hangs on the field. Slow loop. */
bool sensorless_align(struct axis *a);

/*
 * A step while the field is prescribed: the speed's reference moves, the field with it. False where the observer leads, and
 * speed or torque are to be controlled. Slow loop.
 */
bool sensorless_lead_field(struct axis *a, int32_t slope_q16);

/* What comes after the currents' references have been set, and whether the field has to be prescribed again. Slow loop. */
void sensorless_after_control(struct axis *a);

/* The observer's gains, after current_loop_follow(). Slow loop. */
void sensorless_follow(struct axis *a);

/*
 * Whether the observer, or the injection, contradicts itself now: what is asked is asked along an angle that may be nobody's,
 * and what else is odd then is no cause. Lock lost says so soon. Slow loop.
 */
bool sensorless_doubts(const struct axis *a);

/* Whether the observer still has the rotor. Slow loop, each millisecond of operation. */
void sensorless_supervise(struct axis *a);

#endif
