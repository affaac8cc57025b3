/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The twin's own seeded noise, so that a run repeats on any machine. */
#ifndef TWIN_RANDOM_H
#define TWIN_RANDOM_H

#include <stdint.h>

struct random {
    uint64_t state;
    double spare; /* the second of a pair of Gaussian values */
    int have_spare;
};

void random_seed(struct random *r, uint64_t seed);
uint64_t random_u64(struct random *r);
double random_gaussian(struct random *r); /* mean 0, standard deviation 1 */

#endif
