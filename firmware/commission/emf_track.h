/* SPDX-License-Identifier: MIT */
/*
 * The direction of the EMF, seen now and then, always after the same time: where it is at any sample, and how fast it turns. A
 * straight line by least squares through the looks so far, as an alpha-beta filter whose gains fall from look to look
 * (Brookner, "Tracking and Kalman Filtering Made Easy", 1998: the beginning of a track): alpha 2 (2 k - 1) / (k (k + 1)),
 * beta 6 / (k (k + 1)). From the tenth look on they stay, so that a rotor that becomes slower is followed.
 *
 * Angles Q32 of a turn, speeds Q32 a sample, times in samples. A look is right or wrong by whole turns: the speed has to be
 * known so well beforehand that the next look is less than half a turn from where it is expected.
 */
#ifndef FIRMWARE_COMMISSION_EMF_TRACK_H
#define FIRMWARE_COMMISSION_EMF_TRACK_H

#include <stdint.h>

struct emf_track {
    uint32_t looks;
    uint32_t good;      /* in a row: within 22 degrees of where it was expected */
    uint32_t at;        /* the sample of the last look */
    uint32_t angle_q32; /* then */
    int32_t speed_q32;
};

/* The first look, and the speed as two of them show it that lie less than half a turn apart. Slow loop. */
void emf_track_begin(struct emf_track *t, uint32_t at, uint32_t angle_q32, int32_t speed_q32);

/* Takes another, so much later as those before. Slow loop. */
void emf_track_look(struct emf_track *t, uint32_t at, uint32_t angle_q32);

/* Any look, the first one too, from looks = 0 on: of an EMF that turns by less than half a turn between two. Slow loop. */
void emf_track_find(struct emf_track *t, uint32_t at, uint32_t angle_q32);

/* The EMF's direction at a sample. Any context. */
static inline uint32_t emf_track_angle_q32(const struct emf_track *t, uint32_t at)
{
    return t->angle_q32 + (uint32_t)t->speed_q32 * (at - t->at);
}

/* And the rotor's: behind it by a quarter of a turn where it turns forward, ahead of it otherwise. Any context. */
static inline uint32_t emf_track_rotor_q32(const struct emf_track *t, uint32_t at)
{
    return emf_track_angle_q32(t, at) - (t->speed_q32 < 0 ? 0xC0000000u : 0x40000000u);
}

#endif
