/* SPDX-License-Identifier: MIT */
/*
 * The torque that the shaft's place asks for: magnets that cling to teeth, offsets of the sensors, all that comes again each
 * turn. A few harmonics over one mechanical turn, as commission/cogging_learn.h has found them, added to the wish for torque
 * before its limits. Once a millisecond, in the slow loop.
 *
 * It works up to the speed at which the highest harmonic comes as often as the speed loop's bandwidth; from there to twice that
 * it fades.
 */
#ifndef FIRMWARE_CONTROL_COGGING_H
#define FIRMWARE_CONTROL_COGGING_H

#include <stdint.h>

#include "firmware/control/speed_estimate.h"
#include "firmware/settings/tuning.h"

#define COGGING_HARMONICS 8

struct cogging_harmonic {
    uint32_t order;           /* a turn */
    int32_t cos_q23, sin_q23; /* of the torque, Q15 and 8 bits of fraction */
};

struct cogging_map {
    int32_t count;       /* of the harmonics; 0: none is known */
    int32_t full_rpm_q4; /* up to here in full, from twice that not at all */
    int32_t fade_q15;    /* by that speed: 1 / full_rpm_q4 */
    struct cogging_harmonic harmonics[COGGING_HARMONICS];
};

/*
 * How far over its turn the shaft is, from where the encoder's counter is 0: by the last edge, and what it has turned since.
 * 2^32 = one turn. Any context.
 */
static inline uint32_t cogging_angle_q32(const struct speed_estimate *e, const struct tuning *t)
{
    const int32_t beyond_q16 = (int32_t)(((int64_t)e->beyond_q15 * t->count_per_way_q16) >> 16); /* counts */
    const uint32_t edge = e->count + (uint32_t)e->backwards;
    return edge * t->turn_scale_q32 + (uint32_t)(((int64_t)beyond_q16 * t->turn_scale_q32) >> 16);
}

/* Nothing is known. Slow loop, or while it is masked. */
static inline void cogging_forget(struct cogging_map *m)
{
    m->count = 0;
}

/* Up to which speed it acts, for the highest of its harmonics. Thread, slow loop masked. */
void cogging_set_fade(struct cogging_map *m, int32_t speed_bw_hz);

/* The torque, Q15, that the shaft needs at its place to go on as it does. Slow loop: 30 cycles a harmonic. */
int32_t cogging_torque_q15(const struct cogging_map *m, const struct speed_estimate *e, const struct tuning *t);

#endif
