/* SPDX-License-Identifier: MIT */
/* The same numbers in each run: xorshift of 32 bits (G. Marsaglia, Xorshift RNGs, J. Stat. Softw. 8(14), 2003). */
#ifndef STORM_RANDOM_H
#define STORM_RANDOM_H

#include <stdint.h>

static uint32_t seed;

static uint32_t any(uint32_t below)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5;
    return seed % below;
}

#endif
