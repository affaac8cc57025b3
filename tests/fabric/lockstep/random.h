/* SPDX-License-Identifier: MIT */
/* Random numbers that a seed repeats: xorshift64*, of which the upper half is used. */
#ifndef TESTS_FABRIC_RANDOM_H
#define TESTS_FABRIC_RANDOM_H

#include <cstdint>

struct random_source {
    uint64_t state;

    explicit random_source(uint64_t seed) : state(seed * 0x9E3779B97F4A7C15u + 1)
    {
    }

    uint32_t word()
    {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        return (uint32_t)((state * 0x2545F4914F6CDD1Du) >> 32);
    }
    uint32_t below(uint32_t limit)
    {
        return (uint32_t)(((uint64_t)word() * limit) >> 32);
    }
    bool one_in(uint32_t n)
    {
        return below(n) == 0;
    }
};

#endif
