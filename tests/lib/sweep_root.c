/* SPDX-License-Identifier: MIT */
/* polar_root() and polar_root_down() over all squares, against roots that are counted along in 64 bits: in blocks of 2^16, of
 * which `sweep_root 16` takes one in 16, another one in each run of 2^20. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "lib/polar.h"

#define BLOCK 65536u

static uint64_t wrong_in(uint64_t first)
{
    uint64_t down = 0, wrong = 0;

    for (uint64_t bit = 1U << 15; bit != 0; bit >>= 1) {
        down += (down + bit) * (down + bit) <= first ? bit : 0;
    }
    for (uint64_t square = first; square < first + BLOCK; square++) {
        down += (down + 1U) * (down + 1U) == square;
        const uint64_t nearest = down + (square - down * down > down); /* (down + 1/2)^2 is down^2 + down + 1/4 */

        wrong += polar_root_down((uint32_t)square) != (int32_t)down;
        wrong += polar_root((uint32_t)square) != (int32_t)nearest;
    }
    return wrong;
}

int main(int argc, char **argv)
{
    const uint64_t one_in = argc > 1 ? strtoull(argv[1], NULL, 10) : 1;
    uint64_t wrong = 0;

    for (uint64_t block = 0; one_in != 0 && block < BLOCK; block++) {
        const uint64_t run = block / one_in;
        wrong += block % one_in == run % one_in ? wrong_in(block * BLOCK) : 0;
    }
    printf("root, of all squares one in %" PRIu64 ": %" PRIu64 " wrong\n", one_in, wrong);
    return wrong != 0 || one_in == 0;
}
