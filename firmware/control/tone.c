/* SPDX-License-Identifier: MIT */
#include "firmware/control/tone.h"

#include "lib/polar.h"
#include "lib/q15.h"

#define SQUARES_BITS 15
#define C_MOST_Q13   16384 /* 2.0 */
#define REST_MOST    (1 << 16)

/* All three sums in proportion, the squares below 2^SQUARES_BITS. They are not negative. */
static uint32_t shift_to_bits(int64_t squares)
{
    const uint32_t high = (uint32_t)(squares >> 32);
    const int32_t bits = 64 - (high != 0u ? __builtin_clz(high) : 32 + __builtin_clz((uint32_t)squares | 1u));
    return bits > SQUARES_BITS ? (uint32_t)(bits - SQUARES_BITS) : 0u;
}

struct tone_found tone_find(const struct tone *t)
{
    const uint32_t shift = shift_to_bits(t->squares);
    const int32_t squares = (int32_t)(t->squares >> shift);
    if (squares == 0) {
        return (struct tone_found){C_MOST_Q13, REST_MOST};
    }
    const int32_t products = (int32_t)(t->products >> shift); /* below 2^17, but for the ends of a block that grows */
    const int32_t c_q13 = q15_clamp((int32_t)((int64_t)products * 8192 / squares), -C_MOST_Q13, C_MOST_Q13);
    const int64_t rest_q13 =
        (t->sums >> shift) * 8192 - (int64_t)c_q13 * (2 * products) + (((int64_t)c_q13 * c_q13 * squares) >> 13);
    const int64_t share_q13 = rest_q13 / squares;
    return (struct tone_found){c_q13, share_q13 > REST_MOST ? REST_MOST : (int32_t)share_q13};
}

int32_t tone_hz(int32_t c_q13, int32_t sample_hz)
{
    const int32_t sine_q13 = polar_root_down((uint32_t)(C_MOST_Q13 * C_MOST_Q13 - c_q13 * c_q13));
    return (int32_t)(((uint64_t)atan2_q32(sine_q13, c_q13) * (uint32_t)sample_hz + 0x80000000u) >> 32);
}
