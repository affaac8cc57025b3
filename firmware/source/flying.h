/* SPDX-License-Identifier: MIT */
/*
 * Flying start: finds, without an encoder or a voltage sensor, whether the rotor turns at switch-on, and its angle. In this
 * order, every step stays below a tenth of rated torque:
 *
 *   pulses        of some microseconds (commission/pulses.h), bridge off in between, each twice as long as the last until
 *                 3 % of the largest current flows. Two within a quarter of a millisecond give the speed, the others track it
 *   no current    if the longest pulse shows almost no current, the EMF is small enough to switch the current loop on and
 *                 regulate to zero current. Its voltages are then the EMF, and are tracked the same way
 *   then          the observer starts from that angle, speed, and the matching voltages; the gates switch on right after
 *                 a sample, when the PWM already outputs these voltages. The speed loop starts from that speed
 *
 * If neither shows a turning rotor, the start continues as from standstill.
 */
#ifndef FIRMWARE_SOURCE_FLYING_H
#define FIRMWARE_SOURCE_FLYING_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

/* ---- tracking the EMF ---- */

/*
 * Tracks the EMF's direction from measurements at equal intervals: gives its angle at any sample, and its speed. A
 * least-squares line through the measurements so far, as an alpha-beta filter with decreasing gains (Brookner, "Tracking and
 * Kalman Filtering Made Easy", 1998: the beginning of a track): alpha 2 (2 k - 1) / (k (k + 1)), beta 6 / (k (k + 1)). From the
 * tenth measurement on they are constant, to follow a rotor that slows down.
 *
 * Angles Q32 of a turn, speeds Q32 a sample, times in samples. A measurement is ambiguous by whole turns: the speed must be
 * known well enough that the next one is less than half a turn from its expected angle.
 */
struct emf_track {
    uint32_t looks;
    uint32_t good;      /* measurements in a row within 22 degrees of the expected angle */
    uint32_t at;        /* number of the sample of the last one */
    uint32_t angle_q32; /* its angle */
    int32_t speed_q32;
};

/* Starts with the first measurement and a known speed. Slow loop. */
void emf_track_begin(struct emf_track *t, uint32_t at, uint32_t angle_q32, int32_t speed_q32);

/* Adds a measurement, after the same interval as before. Slow loop. */
void emf_track_add(struct emf_track *t, uint32_t at, uint32_t angle_q32);

/* Adds any measurement, also the first (looks = 0), where the EMF turns by less than half a turn between two. Slow loop. */
void emf_track_add_any(struct emf_track *t, uint32_t at, uint32_t angle_q32);

/* The EMF's direction at a sample. Any context. */
static inline uint32_t emf_track_angle_q32(const struct emf_track *t, uint32_t at)
{
    return t->angle_q32 + (uint32_t)t->speed_q32 * (at - t->at);
}

/* The rotor's angle: a quarter turn behind the EMF when turning forward, else ahead of it. Any context. */
static inline uint32_t emf_track_rotor_q32(const struct emf_track *t, uint32_t at)
{
    return emf_track_angle_q32(t, at) - (t->speed_q32 < 0 ? 0xC0000000u : 0x40000000u);
}

/* ---- the search ---- */

enum flying_result {
    FLYING_SEARCHES,
    FLYING_CAUGHT, /* the observer gives the angle */
    FLYING_STANDS, /* at or near standstill; the bridge may be on, with no current */
};

struct flying {
    uint32_t ms;
    uint32_t quiet;  /* measurements without a result */
    uint32_t counts; /* of a pulse */
    bool regulates;  /* second step: current control to zero */
    struct emf_track track;
};

/* Slow loop, bridge off, zero of the sensors known. */
void flying_begin(struct axis *a);

/* One step a millisecond; the first part of the search takes up to half of it. May raise a fault instead. Slow loop. */
enum flying_result flying_step(struct axis *a);

/*
 * Starts from a known angle at the next sample, and speed; the observer gives the angle 3 samples later. Slow loop, bridge off,
 * LOOP_OBSERVER.
 */
void flying_resume(struct axis *a, uint32_t angle_q32, int32_t speed_q32);

#endif
