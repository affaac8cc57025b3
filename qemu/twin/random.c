/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Uniform bits: the SplitMix64 sequence (G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number
 * generators", OOPSLA 2014). Gaussian: the polar method of G. Marsaglia. */
#include "random.h"

#include <math.h>

void random_seed(struct random *r, uint64_t seed)
{
    r->state = seed;
    r->have_spare = 0;
}

/* SplitMix64 runs through one cycle of 2^64 states whatever the seed: scattered starts keep the streams apart. */
void random_seed_stream(struct random *r, uint64_t seed, enum random_stream stream)
{
    random_seed(r, seed);
    uint64_t scattered = random_u64(r);
    random_seed(r, scattered + (uint64_t)stream);
    random_seed(r, random_u64(r));
}

uint64_t random_u64(struct random *r)
{
    r->state += 0x9E3779B97F4A7C15u;
    uint64_t z = r->state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static double minus_one_to_one(struct random *r)
{
    return (double)(random_u64(r) >> 11) * 0x1p-52 - 1.0;
}

double random_gaussian(struct random *r)
{
    if (r->have_spare) {
        r->have_spare = 0;
        return r->spare;
    }
    double x, y, radius_squared;
    do {
        x = minus_one_to_one(r);
        y = minus_one_to_one(r);
        radius_squared = x * x + y * y;
    } while (radius_squared >= 1 || radius_squared == 0);
    double scale = sqrt(-2 * log(radius_squared) / radius_squared);
    r->spare = y * scale;
    r->have_spare = 1;
    return x * scale;
}

double random_exponential(struct random *r)
{
    return -log((double)((random_u64(r) >> 11) + 1) * 0x1p-53);
}

/* Four values of 16 bits: their sum has the mean 2 (2^16 - 1) and the variance (2^32 - 1) / 3. */
double random_bell(struct random *r)
{
    uint64_t bits = random_u64(r);
    uint32_t sum = (uint32_t)(bits & 0xFFFF) + (uint32_t)(bits >> 16 & 0xFFFF) + (uint32_t)(bits >> 32 & 0xFFFF) +
                   (uint32_t)(bits >> 48);
    return ((double)sum - 131070.0) * 2.642899792e-5; /* by sqrt((2^32 - 1) / 3) */
}
