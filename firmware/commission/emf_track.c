/* SPDX-License-Identifier: MIT */
#include "firmware/commission/emf_track.h"

#include "lib/q15.h"

#define NEAR_Q32   (1 << 28)
#define LOOKS_MOST 10

void emf_track_begin(struct emf_track *t, uint32_t at, uint32_t angle_q32, int32_t speed_q32)
{
    *t = (struct emf_track){.looks = 1, .at = at, .angle_q32 = angle_q32, .speed_q32 = speed_q32};
}

void emf_track_look(struct emf_track *t, uint32_t at, uint32_t angle_q32)
{
    const int32_t since = q15_max((int32_t)(at - t->at), 1);
    const uint32_t expected_q32 = emf_track_angle_q32(t, at);
    const int32_t off_q32 = (int32_t)(angle_q32 - expected_q32);
    const int32_t k = q15_min((int32_t)t->looks + 1, LOOKS_MOST);
    const int32_t share_q32 = off_q32 / (k * (k + 1));
    t->good = q15_abs(off_q32 / 2) < NEAR_Q32 / 2 ? t->good + 1u : 0u;
    t->angle_q32 = expected_q32 + (uint32_t)(share_q32 * 2 * (2 * k - 1));
    t->speed_q32 += share_q32 / since * 6;
    t->at = at;
    t->looks++;
}

void emf_track_find(struct emf_track *t, uint32_t at, uint32_t angle_q32)
{
    if (t->looks == 0u) {
        emf_track_begin(t, at, angle_q32, 0);
    } else if (t->looks == 1u) {
        const int32_t turned_q32 = (int32_t)(angle_q32 - t->angle_q32);
        emf_track_begin(t, at, angle_q32, turned_q32 / q15_max((int32_t)(at - t->at), 1));
        t->looks = 2u;
    } else {
        emf_track_look(t, at, angle_q32);
    }
}
