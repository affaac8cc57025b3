/* SPDX-License-Identifier: MIT */
/*
 * Tracks the EMF's direction from looks at equal intervals: gives its angle at any sample, and its speed. A least-squares line
 * through the looks so far, as an alpha-beta filter whose gains fall from look to look (Brookner, "Tracking and Kalman
 * Filtering Made Easy", 1998: the beginning of a track): alpha 2 (2 k - 1) / (k (k + 1)), beta 6 / (k (k + 1)). From the tenth
 * look on they stay constant, to follow a rotor that slows down.
 *
 * Angles Q32 of a turn, speeds Q32 a sample, times in samples. A look can be wrong by whole turns: the speed must be known
 * well enough that the next look is less than half a turn from where it is expected.
 */
#ifndef FIRMWARE_COMMISSION_EMF_TRACK_H
#define FIRMWARE_COMMISSION_EMF_TRACK_H

#include <stdint.h>

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

#endif
