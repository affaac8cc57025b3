/* SPDX-License-Identifier: MIT */
/*
 * Every product term of the Park kernels by itself, for every pair of 16-bit values and a fraction from -1.0 to 1.0, both ends
 * included: 2^32 pairs a term. A result is right if it is the nearest to the product, a tie the upper one: its error e,
 * in units of 2^-15 LSB, lies in -16384 < e <= 16384. Prints the number of wrong results of each term.
 */
#include <stdio.h>

#ifdef ROUND_DOWN /* for the test of the test */
#define q15_from_q30 q15_from_q30_rounding
#include "lib/q15.h"
#undef q15_from_q30
#define q15_from_q30(x) ((x) >> 15)
#endif
#include "lib/transform_q15.h"

#ifdef __x86_64__
#define FAST __attribute__((target_clones("avx2", "default")))
#else
#define FAST
#endif

#define WRONG(name, expression, product) \
    FAST static unsigned long name(int32_t x) \
    { \
        unsigned wrong = 0; \
        for (int32_t y = -32768; y <= 32768; y++) { \
            const int32_t error = 32768 * (expression) - (product); \
            wrong += (unsigned)(error <= -16384) | (unsigned)(error > 16384); \
        } \
        return wrong; \
    }

WRONG(park_alpha_cos, park_q15((alphabeta_t){x, 0}, (cossin_t){y, 0}).d, x *y)
WRONG(park_beta_sin, park_q15((alphabeta_t){0, x}, (cossin_t){0, y}).d, x *y)
WRONG(park_beta_cos, park_q15((alphabeta_t){0, x}, (cossin_t){y, 0}).q, x *y)
WRONG(park_alpha_sin, park_q15((alphabeta_t){x, 0}, (cossin_t){0, y}).q, -x *y)
WRONG(invpark_d_cos, invpark_q15((dq_t){x, 0}, (cossin_t){y, 0}).alpha, x *y)
WRONG(invpark_q_sin, invpark_q15((dq_t){0, x}, (cossin_t){0, y}).alpha, -x *y)
WRONG(invpark_q_cos, invpark_q15((dq_t){0, x}, (cossin_t){y, 0}).beta, x *y)
WRONG(invpark_d_sin, invpark_q15((dq_t){x, 0}, (cossin_t){0, y}).beta, x *y)

static void sweep(const char *name, unsigned long (*wrong)(int32_t))
{
    unsigned long sum = 0;
    for (int32_t x = -32768; x <= 32767; x++) {
        sum += wrong(x);
    }
    printf("%s %lu\n", name, sum);
}

#define SWEEP(name) sweep(#name, name)

int main(void)
{
    SWEEP(park_alpha_cos);
    SWEEP(park_beta_sin);
    SWEEP(park_beta_cos);
    SWEEP(park_alpha_sin);
    SWEEP(invpark_d_cos);
    SWEEP(invpark_q_sin);
    SWEEP(invpark_q_cos);
    SWEEP(invpark_d_sin);
    return 0;
}
