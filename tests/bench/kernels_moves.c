/* SPDX-License-Identifier: MIT */
/* What the functions around the kernels do besides the kernel: fetch the arguments, store the results. */
#include "tests/bench/kernels.h"

static inline __attribute__((always_inline)) void moves(const int32_t *in, int32_t *out, int reads, int writes)
{
    int32_t word[BENCH_KERNEL_WORDS] = {0};
#pragma GCC unroll 6
    for (int k = 0; k < reads; k++) {
        word[k] = in[k];
    }
#pragma GCC unroll 6
    for (int k = 0; k < reads; k++) {
        __asm volatile("" : "+r"(word[k])); /* in a register, needed or not */
    }
#pragma GCC unroll 6
    for (int k = 0; k < writes; k++) {
        out[k] = word[k < reads ? k : 0];
    }
}

#define DEFINE_MOVES(name, reads, writes) \
    void moves_##name(const int32_t *in, int32_t *out) \
    { \
        moves(in, out, reads, writes); \
    }

BENCH_LIB_FUNCTIONS(DEFINE_MOVES)
BENCH_KERNELS(DEFINE_MOVES)
