/* SPDX-License-Identifier: MIT */
/* The data that the functions are timed with: the same on every machine and every day. */
#ifndef TESTS_BENCH_VECTORS_H
#define TESTS_BENCH_VECTORS_H

#include <stdint.h>

struct vector_range {
    int32_t low, high;
};

/* All combinations of the corners of up to four arguments; of more, as many chosen at random. */
#define VECTOR_CORNERS       9u
#define VECTOR_EXTREME_COUNT (VECTOR_CORNERS * VECTOR_CORNERS * VECTOR_CORNERS * VECTOR_CORNERS)

/* How many different vectors of corners there are to try for `words` arguments. */
uint32_t vector_extreme_count(uint32_t words);

/* The corner vector with this index: ends of the range, and the values about which timing or branches may change. */
void vector_extreme(int32_t *vector, const struct vector_range *ranges, uint32_t words, uint32_t index);

/* Anywhere in the ranges. */
void vector_typical(int32_t *vector, const struct vector_range *ranges, uint32_t words);

/* One value, anywhere in low...high. */
int32_t vector_random(int32_t low, int32_t high);

/* Begins the sequence of random values anew. */
void vector_restart(void);

#endif
