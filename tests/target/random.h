/* SPDX-License-Identifier: MIT */
/* Numbers for tests on the target, the same in every run: xorshift of 32 bits (Marsaglia), corners often among them. */
#ifndef TESTS_TARGET_RANDOM_H
#define TESTS_TARGET_RANDOM_H

#include <stdint.h>

#define RANDOM_SEED 0x2545F491u

static inline uint32_t random_next(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

/* -limit ... limit, every fourth time one of the ends, 0 or next to it. */
static inline int32_t random_any(uint32_t *state, int32_t limit)
{
    const int32_t corners[4] = {-limit, limit, 0, -1};
    const uint32_t choice = random_next(state) & 15u;
    return choice < 4u ? corners[choice] : (int32_t)(random_next(state) % (2u * (uint32_t)limit + 1u)) - limit;
}

#endif
