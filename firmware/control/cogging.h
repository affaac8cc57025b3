/* SPDX-License-Identifier: MIT */
/*
 * Compensates torque that repeats each mechanical turn: cogging, sensor offsets. Adds a few harmonics, found by
 * commission/learn.h, to the torque demand before its limits. Once a millisecond, in the slow loop.
 *
 * It acts fully until the highest harmonic's frequency reaches the speed loop's bandwidth, and fades out by twice that speed.
 */
#ifndef FIRMWARE_CONTROL_COGGING_H
#define FIRMWARE_CONTROL_COGGING_H

#include <stdint.h>

#include "firmware/control/speed_estimate.h"
#include "firmware/settings/tuning.h"

#define COGGING_HARMONICS 8

struct cogging_harmonic {
    uint32_t order;           /* per turn */
    int32_t cos_q23, sin_q23; /* of the torque, Q15 with 8 more bits */
};

struct cogging_map {
    int32_t count;       /* harmonics; 0: none known */
    int32_t full_rpm_q4; /* full up to this speed, zero from twice that */
    int32_t fade_q15;    /* 1 / full_rpm_q4 */
    struct cogging_harmonic harmonics[COGGING_HARMONICS];
};

/*
 * The shaft's mechanical angle from the encoder's zero count: the last edge plus the travel since. 2^32 = one turn. Any
 * context.
 */
static inline uint32_t cogging_angle_q32(const struct speed_estimate *e, const struct tuning *t)
{
    const int32_t beyond_q16 = (int32_t)(((int64_t)e->beyond_q15 * t->counts_per_travel_q16) >> 16); /* counts */
    const uint32_t edge = e->count + (uint32_t)e->backwards;
    return edge * t->turn_scale_q32 + (uint32_t)(((int64_t)beyond_q16 * t->turn_scale_q32) >> 16);
}

/* Clears the map. Slow loop, or while it is masked. */
static inline void cogging_forget(struct cogging_map *m)
{
    m->count = 0;
}

/* Sets the fade speed from the highest harmonic. Thread, slow loop masked. */
void cogging_set_fade(struct cogging_map *m, int32_t speed_bw_hz);

/* The compensating torque, Q15, at the shaft's present angle. Slow loop: 30 cycles a harmonic. */
int32_t cogging_torque_q15(const struct cogging_map *m, const struct speed_estimate *e, const struct tuning *t);

#endif
