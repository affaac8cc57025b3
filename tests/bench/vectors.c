/* SPDX-License-Identifier: MIT */
#include "tests/bench/vectors.h"

static uint32_t state = 1u;

/* Marsaglia's xorshift (2003), period 2^32 - 1; the state is never 0. */
static uint32_t random_word(void)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
}

void vector_restart(void)
{
    state = 1u;
}

int32_t vector_random(int32_t low, int32_t high)
{
    const uint64_t span = (uint64_t)((int64_t)high - low) + 1u;
    return (int32_t)(low + (int64_t)((span * random_word()) >> 32));
}

void vector_typical(int32_t *vector, const struct vector_range *ranges, uint32_t words)
{
    for (uint32_t k = 0; k < words; k++) {
        vector[k] = vector_random(ranges[k].low, ranges[k].high);
    }
}

uint32_t vector_extreme_count(uint32_t words)
{
    uint32_t count = 1u;
    for (uint32_t k = 0; k < words && count < VECTOR_EXTREME_COUNT; k++) {
        count *= VECTOR_CORNERS;
    }
    return count;
}

/* Long multiplies take another time from 65536 on, and for negative numbers; branches turn at 0 and at the limits. */
static int32_t corner(struct vector_range range, uint32_t which)
{
    const int32_t corners[VECTOR_CORNERS] = {range.low, range.high, 0, 1, -1, 65535, 65536, -65536, 32767};
    const int32_t value = corners[which];
    return value < range.low ? range.low : (value > range.high ? range.high : value);
}

void vector_extreme(int32_t *vector, const struct vector_range *ranges, uint32_t words, uint32_t index)
{
    for (uint32_t k = 0; k < words; k++) {
        const uint32_t which = words > 4u ? random_word() % VECTOR_CORNERS : index % VECTOR_CORNERS;
        vector[k] = corner(ranges[k], which);
        index /= VECTOR_CORNERS;
    }
}
