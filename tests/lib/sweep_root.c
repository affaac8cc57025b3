/* SPDX-License-Identifier: MIT */
/* polar_root() and polar_root_down() over all squares, against roots that are counted along in 64 bits. */
#include <inttypes.h>
#include <stdio.h>

#include "lib/polar.h"

int main(void)
{
    uint64_t down = 0;
    uint64_t wrong = 0;

    for (uint64_t square = 0; square <= UINT32_MAX; square++) {
        down += (down + 1U) * (down + 1U) == square;
        const uint64_t nearest = down + (square - down * down > down); /* (down + 1/2)^2 is down^2 + down + 1/4 */

        wrong += polar_root_down((uint32_t)square) != (int32_t)down;
        wrong += polar_root((uint32_t)square) != (int32_t)nearest;
    }
    printf("%" PRIu64 " wrong\n", wrong);
    return 0;
}
