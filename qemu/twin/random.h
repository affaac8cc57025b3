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

/* The sources of noise beside the converter's, which takes the seed itself. */
enum random_stream {
    STREAM_EDGE_NOISE = 1,
    STREAM_LOST_COUNTS,
    STREAM_EXTRA_COUNTS,
    STREAM_MODULATORS,
    STREAM_ENVM,
    STREAM_FIC0,
    STREAM_SECOND_AXIS
};

void random_seed(struct random *r, uint64_t seed);
/* One of many sequences of the same seed: each source of noise takes its own, and none shifts another. */
void random_seed_stream(struct random *r, uint64_t seed, enum random_stream stream);
uint64_t random_u64(struct random *r);
double random_gaussian(struct random *r);    /* mean 0, standard deviation 1 */
double random_exponential(struct random *r); /* mean 1 */
/* Mean 0, standard deviation 1, within +-3.5: the sum of four uniform values, for what is drawn in each clock. */
double random_bell(struct random *r);

#endif
