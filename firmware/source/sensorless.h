/* SPDX-License-Identifier: MIT */
/*
 * Operation without an encoder. With enough EMF the flux observer (control/observer.h) gives the angle: currents are regulated
 * in its frame; speed and torque are controlled as usual. With too little, I-f control: a current vector turns at the reference
 * speed and the rotor follows (for example Wang, Lu, Zhang: "Sensorless control of PMSM from zero speed by I-f", and texts on
 * synchronous starting). Load shifts the rotor from the field by asin(T / T_max); nothing else shows it.
 *
 *   start        the field steps through three angles, from 90 degrees to 0, because there is no torque at 180 degrees.
 *                Voltages are held, not currents: a winding at a fixed voltage damps the rotor's oscillation
 *   field        the observer is locked to the field until there is enough EMF, and then runs free
 *   hand-over    when the margin was large enough and the rotor steady for 20 ms. The frame turns to the rotor, and
 *                voltages and currents with it, so nothing changes; then the current without torque is ramped down
 *   and back     below the smaller margin. The frame turns so that the field's current lies along it, and the missing
 *                current ramps up; torque and speed stay as they were
 */
#ifndef FIRMWARE_SOURCE_SENSORLESS_H
#define FIRMWARE_SOURCE_SENSORLESS_H

#include <stdbool.h>
#include <stdint.h>

/* ==== injection or observer ==== */

/*
 * Selects the source of the rotor's angle in operation: injection at low speed, the flux observer above, by the margin of
 * observability (control/observer.h) with hysteresis. Both share frame, angle, speed, voltages and integrals; the observer's
 * flux is set from angle and currents.
 */

struct axis;

/* Changes from injection to the observer when its margin suffices. Slow loop, in injection, after the control. */
void injection_after_control(struct axis *a);

/* True if the observer's tracking loop is now too slow and injection is available. Slow loop, with the observer. */
bool injection_should_lead(const struct axis *a);

/* The margin is too small: injection takes over; false if not available. Slow loop. */
bool injection_takes_over(struct axis *a);

struct axis;

struct sensorless {
    uint32_t ms;        /* of the start, at this angle */
    uint32_t step;      /* of the start */
    int32_t v_q23;      /* voltage held meanwhile */
    int32_t i_q23;      /* its current, with the same filter */
    int32_t v_full_q23; /* both, at full current */
    int32_t i_full_q23;
    int32_t ref_rpm_q16;       /* the speed's reference a millisecond ago */
    int32_t i_q15;             /* the field's current */
    int32_t lag_q32;           /* the rotor's observed lag behind it, filtered */
    int32_t grows_q32;         /* its growth per millisecond */
    int32_t rest_q32;          /* mean lag, about which the rotor oscillates */
    bool observed;             /* the observer runs free, and its angle is valid */
    uint32_t steady_ms;        /* how long the observer's angle was good enough */
    uint32_t weak_ms;          /* how long it was not */
    int32_t extra_q15;         /* d current without torque, left from the field */
    uint32_t angle_before_q32; /* the rotor's a millisecond ago (rotor.c) */
};

/* Starts to align the rotor with the field. Slow loop, bridge on, LOOP_OBSERVER. */
void sensorless_begin(struct axis *a);

/* One step a millisecond; true once the rotor follows the field. Slow loop. */
bool sensorless_align(struct axis *a);

/*
 * One step of I-f control: ramps the speed reference, and the field with it. False if the observer gives the angle; then the
 * caller controls speed or torque. Slow loop.
 */
bool sensorless_lead_field(struct axis *a, int32_t slope_q16);

/* Runs after the current references are set; decides about returning to I-f control. Slow loop. */
void sensorless_after_control(struct axis *a);

/* The observer's gains, after current_loop_follow(). Slow loop. */
void sensorless_follow(struct axis *a);

#endif
