/* SPDX-License-Identifier: MIT */
/*
 * polar_root() over all squares: the largest error, and whether it ever falls. Squares that differ in bits which it drops, 12
 * of the normalized square, have the same root, so the ends of each such step are enough.
 */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#include "lib/polar.h"

static double worst;
static bool monotone = true;
static int32_t before;

static void check(uint64_t square)
{
    const int32_t root = polar_root((uint32_t)square);
    const double error = fabs((double)root - sqrt((double)square));

    worst = error > worst ? error : worst;
    monotone = monotone && root >= before;
    before = root;
}

int main(void)
{
    uint64_t step = 1;

    for (uint64_t square = 0; square >> 32 == 0; square += step) {
        while (step < 4096U && square >> 20 >= step) { /* four times as many squares in a step for every two bits */
            step *= 4U;
        }
        check(square);
        check(square + step - 1U);
    }
    printf("worst %.3f, %s\n", worst, monotone ? "monotone" : "not monotone");
    return 0;
}
