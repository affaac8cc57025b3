/* SPDX-License-Identifier: MIT */
/*
 * The library's functions behind one signature each, built four times under four prefixes:
 *
 *     shipped_  as the firmware uses them, -O2
 *     o2_, o3_  their portable C (LIB_PORTABLE), -O2 and -O3
 *     moves_    the same loads and stores with no arithmetic between them: what is left of a call when it is inlined
 *
 * X(name, words read, words written). The four functions of Lib.h are called as they are; the others are inline, and get a
 * function around them that reads its arguments from memory and writes its results there.
 */
#ifndef TESTS_BENCH_KERNELS_H
#define TESTS_BENCH_KERNELS_H

#include <stdint.h>

#define BENCH_LIB_FUNCTIONS(X) \
    X(Clarke_Lib_Do, 2, 2) \
    X(InvClarke_Lib_Do, 2, 3) \
    X(Park_Lib_Do, 4, 2) \
    X(InvPark_Lib_Do, 4, 2)

#define BENCH_KERNELS(X) \
    X(clarke_q15, 2, 2) \
    X(invclarke_q15, 2, 3) \
    X(park_q15, 4, 2) \
    X(invpark_q15, 4, 2) \
    X(cossin_q15, 1, 2) \
    X(clarke3_q15, 3, 2) \
    X(clarke_bc_q15, 2, 2) \
    X(clarke_ca_q15, 2, 2) \
    X(atan2_q15, 2, 1) \
    X(magnitude_q15, 2, 1) \
    X(pi_q15_step, 5, 2) \
    X(circle_rest_q15, 2, 1) \
    X(svm_minmax, 2, 3) \
    X(deadtime_share_q7, 1, 1) \
    X(advance_q15, 3, 2) \
    X(pll_step, 3, 2)

#define BENCH_KERNEL_WORDS 6u

#define BENCH_DECLARE_KERNEL(name, reads, writes) \
    void shipped_##name(const int32_t *in, int32_t *out); \
    void o2_##name(const int32_t *in, int32_t *out); \
    void o3_##name(const int32_t *in, int32_t *out);
#define BENCH_DECLARE_MOVES(name, reads, writes) void moves_##name(const int32_t *in, int32_t *out);

BENCH_KERNELS(BENCH_DECLARE_KERNEL)
BENCH_KERNELS(BENCH_DECLARE_MOVES)
BENCH_LIB_FUNCTIONS(BENCH_DECLARE_MOVES)

#endif
