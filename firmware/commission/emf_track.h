/* SPDX-License-Identifier: MIT */
/*
 * The direction of the EMF, seen now and then: where it is at any sample, and how fast it turns. A predictor with two gains
 * (alpha-beta filter: Kalata, "The tracking index", IEEE Trans. Aerosp. Electron. Syst. 20(2), 1984), alpha a half and beta a
 * quarter: errors fall to a quarter in three looks without overshoot that matters.
 *
 * Angles Q32 of a turn, speeds Q32 a sample, times in samples. A look is right or wrong by whole turns: the second one may come
 * after half a turn at most, later ones after as long as the speed is known well enough for.
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

/* Takes a look. Slow loop. */
void emf_track_look(struct emf_track *t, uint32_t at, uint32_t angle_q32);

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
