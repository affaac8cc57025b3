/* SPDX-License-Identifier: MIT */
/*
 * Flying start: finds, without an encoder or a voltage sensor, whether the rotor turns at switch-on, and where it is. The order
 * keeps every step below a tenth of rated torque:
 *
 *   pulses        of some microseconds (commission/pulses.h), bridge off in between, each twice as long as the last until
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

struct axis;

/* ---- the EMF, from look to look ---- */

/*
 * Tracks the EMF's direction from looks at equal intervals: gives its angle at any sample, and its speed. A least-squares line
 * through the looks so far, as an alpha-beta filter whose gains fall from look to look (Brookner, "Tracking and Kalman
 * Filtering Made Easy", 1998: the beginning of a track): alpha 2 (2 k - 1) / (k (k + 1)), beta 6 / (k (k + 1)). From the tenth
 * look on they stay constant, to follow a rotor that slows down.
 *
 * Angles Q32 of a turn, speeds Q32 a sample, times in samples. A look can be wrong by whole turns: the speed must be known
 * well enough that the next look is less than half a turn from where it is expected.
 */
struct emf_track {
    uint32_t looks;
    uint32_t good;      /* looks in a row within 22 degrees of the expected angle */
    uint32_t at;        /* the sample of the last look */
    uint32_t angle_q32; /* then */
    int32_t speed_q32;
};

/* Takes the first look, and the speed from two looks less than half a turn apart. Slow loop. */
void emf_track_begin(struct emf_track *t, uint32_t at, uint32_t angle_q32, int32_t speed_q32);

/* Takes another look, after the same interval as before. Slow loop. */
void emf_track_look(struct emf_track *t, uint32_t at, uint32_t angle_q32);

/* Takes any look, also the first, from looks = 0 on: the EMF must turn less than half a turn between two. Slow loop. */
void emf_track_find(struct emf_track *t, uint32_t at, uint32_t angle_q32);

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
