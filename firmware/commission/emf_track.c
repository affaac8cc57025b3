/* SPDX-License-Identifier: MIT */
#include "firmware/commission/emf_track.h"

#include "lib/q15.h"

#define NEAR_Q32 (1 << 28)

void emf_track_look(struct emf_track *t, uint32_t at, uint32_t angle_q32)
{
    const int32_t since = (int32_t)(at - t->at);
    const int32_t off_q32 = (int32_t)(angle_q32 - emf_track_angle_q32(t, at));
    if (t->looks == 0u) {
        t->angle_q32 = angle_q32;
    } else if (t->looks == 1u) {
        t->speed_q32 = off_q32 / q15_max(since, 1);
        t->angle_q32 = angle_q32;
    } else {
        t->good = q15_abs(off_q32 >> 1) < NEAR_Q32 >> 1 ? t->good + 1u : 0u;
        t->angle_q32 = angle_q32 - (uint32_t)(off_q32 / 2);
        t->speed_q32 += off_q32 / 4 / q15_max(since, 1);
    }
    t->at = at;
    t->looks++;
}
