/* SPDX-License-Identifier: MIT */
/* Electrical angles as signed parts of a turn: 1.0 = 2^32, so they wrap by themselves and half a turn is INT32_MIN. */
#ifndef LIB_ANGLE_H
#define LIB_ANGLE_H

#include <stdint.h>

/** How far from 0, either way: 0 ... 2^31, for any angle, half a turn included; also for a speed in turns a sample. */
static inline uint32_t angle_size_q32(int32_t angle_q32)
{
    return angle_q32 < 0 ? 0u - (uint32_t)angle_q32 : (uint32_t)angle_q32;
}

#endif
