/* SPDX-License-Identifier: MIT */
/*
 * Operation without an encoder. When the EMF shows the rotor, the flux observer leads (control/observer.h): currents are
 * regulated in its frame; speed and torque are controlled as usual. When it does not, a field is prescribed: a current vector
 * that the rotor follows turns at the reference speed (I-f, for example Wang, Lu, Zhang: "Sensorless control of PMSM from zero
 * speed by I-f", and every text on synchronous starting). Load shifts the rotor from the field by asin(T / T_max), and nothing
 * else shows it.
 *
 *   start        the field steps through three angles, from 90 degrees to 0, since a rotor opposite the field feels no pull.
 *                Voltages are held, not currents: a winding at a fixed voltage damps a swinging rotor
 *   field        the observer is held to the field until there is something to see, and then finds the rotor by itself
 *   hand-over    when the margin has been large enough and the rotor calm for 20 ms. The frame turns to the rotor, and
 *                voltages and currents with it, so nothing changes; then the current that makes no torque fades
 *   and back     below the smaller margin. The frame turns so that the field's current lies along it, and the missing
 *                current ramps up; torque and speed stay as they were
 */
#ifndef FIRMWARE_SOURCE_SENSORLESS_H
#define FIRMWARE_SOURCE_SENSORLESS_H

#include <stdbool.h>
#include <stdint.h>

/* ==== the lead of injection's angle ==== */

/*
 * Chooses what gives the rotor's angle in operation, saliency or EMF: injection below, the flux observer above, by the margin
 * of observability (control/observer.h) with hysteresis. Both share frame, angle, speed, voltages and integrals, so one store
 * hands over; the observer's flux is set from angle and currents.
 */

struct axis;

/* From injection to the observer, if that sees enough. Slow loop, while injection leads, after the control. */
void injection_after_control(struct axis *a);

/* True if the observer's tracking loop is now too slow and injection is available. Slow loop, while the observer leads. */
bool injection_should_lead(const struct axis *a);

/* The observer sees too little: injection takes over; false if there is none. Slow loop. */
bool injection_takes_over(struct axis *a);

/* Gains, after current_loop_follow(). Slow loop, while injection leads. */
void injection_lead_follow(struct axis *a);

struct axis;

struct sensorless {
    uint32_t ms;        /* of the start, along this angle */
    uint32_t step;      /* of it */
    int32_t v_q23;      /* voltage held meanwhile */
    int32_t i_q23;      /* and the current it drives, equally smoothed */
    int32_t v_full_q23; /* both at full current */
    int32_t i_full_q23;
    int32_t ref_rpm_q16;       /* the speed's reference a millisecond ago */
    int32_t i_q15;             /* the field's current */
    int32_t lag_q32;           /* how far the rotor lags behind it, as observed; smoothed */
    int32_t grows_q32;         /* its growth per millisecond */
    int32_t rest_q32;          /* the value it swings about: the lag, smoothed longer */
    bool sees;                 /* the observer runs free, and these are valid */
    uint32_t calm_ms;          /* how long the observer could have led */
    uint32_t weak_ms;          /* how long it should not lead */
    int32_t extra_q15;         /* d current that makes no torque, left from the field */
    uint32_t angle_before_q32; /* the rotor's a millisecond ago (rotor.c) */
};

/* Starts to align the rotor with the field. Slow loop, bridge on, LOOP_OBSERVER. */
void sensorless_begin(struct axis *a);

/* One step a millisecond; true once the rotor follows the field. Slow loop. */
bool sensorless_align(struct axis *a);

/*
 * One step while the field is prescribed: moves the speed reference, and the field with it. False if the observer leads, and
 * the caller must control speed or torque. Slow loop.
 */
bool sensorless_lead_field(struct axis *a, int32_t slope_q16);

/* Runs after the current references are set; decides whether to prescribe the field again. Slow loop. */
void sensorless_after_control(struct axis *a);

/* The observer's gains, after current_loop_follow(). Slow loop. */
void sensorless_follow(struct axis *a);

#endif
