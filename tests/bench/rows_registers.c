/* SPDX-License-Identifier: MIT */
/*
 * The Q15 kernels in registers, as in the middle of a loop: between the two readings there is nothing but the kernel, whose
 * arguments are in registers before and whose results are in registers after. The kernel runs once before, so that constants
 * may be in registers too.
 */
#include <stddef.h>

#include "lib/clarke3.h"
#include "lib/polar.h"
#include "lib/trig.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define ARGUMENTS_MAX 4u
#define ROUNDS        255u

#define ONE(x)            "+r"(x)
#define TWO(x, y)         "+r"(x), "+r"(y)
#define THREE(x, y, z)    "+r"(x), "+r"(y), "+r"(z)
#define FOUR(x, y, z, w)  "+r"(x), "+r"(y), "+r"(z), "+r"(w)
#define IN_REGISTERS(...) __asm volatile("" : __VA_ARGS__)

/* `arguments`: the variables among w0...w3 which `call` takes; `results`: the fields of its result r. */
#define REGISTERS_TIMER(kernel, type, call, arguments, results) \
    static __attribute__((noinline, aligned(8))) uint32_t time_##kernel##_registers(const void *in, void *out) \
    { \
        const int32_t *const word = in; \
        int32_t w0 = word[0], w1 = word[1], w2 = word[2], w3 = word[3]; \
        type r = call; \
        IN_REGISTERS(results); \
        IN_REGISTERS(FOUR(w0, w1, w2, w3)); \
        const uint32_t start = dwt_cycles(); \
        IN_REGISTERS(arguments); \
        r = call; \
        IN_REGISTERS(results); \
        const uint32_t counted = dwt_cycles() - start; \
        *(type *)out = r; \
        return counted; \
    }

REGISTERS_TIMER(clarke_q15, alphabeta_t, clarke_q15(w0, w1), TWO(w0, w1), TWO(r.alpha, r.beta))
REGISTERS_TIMER(invclarke_q15, abc_t, invclarke_q15((alphabeta_t){w0, w1}), TWO(w0, w1), THREE(r.a, r.b, r.c))
REGISTERS_TIMER(park_q15, dq_t, park_q15((alphabeta_t){w0, w1}, (cossin_t){w2, w3}), FOUR(w0, w1, w2, w3),
                TWO(r.d, r.q))
REGISTERS_TIMER(invpark_q15, alphabeta_t, invpark_q15((dq_t){w0, w1}, (cossin_t){w2, w3}), FOUR(w0, w1, w2, w3),
                TWO(r.alpha, r.beta))
REGISTERS_TIMER(cossin_q15, cossin_t, cossin_q15((uint32_t)w0), ONE(w0), TWO(r.cos, r.sin))
REGISTERS_TIMER(clarke3_q15, alphabeta_t, clarke3_q15((abc_t){w0, w1, w2}), THREE(w0, w1, w2), TWO(r.alpha, r.beta))
REGISTERS_TIMER(clarke_bc_q15, alphabeta_t, clarke_bc_q15(w0, w1), TWO(w0, w1), TWO(r.alpha, r.beta))
REGISTERS_TIMER(clarke_ca_q15, alphabeta_t, clarke_ca_q15(w0, w1), TWO(w0, w1), TWO(r.alpha, r.beta))
REGISTERS_TIMER(atan2_q15, uint32_t, atan2_q15(w0, w1), TWO(w0, w1), ONE(r))
REGISTERS_TIMER(magnitude_q15, int32_t, magnitude_q15(w0, w1), TWO(w0, w1), ONE(r))

static const struct {
    const char *name;
    timer_function timer;
} rows[] = {
    {"clarke_q15.registers", time_clarke_q15_registers},
    {"park_q15.registers", time_park_q15_registers},
    {"invpark_q15.registers", time_invpark_q15_registers},
    {"invclarke_q15.registers", time_invclarke_q15_registers},
    {"cossin_q15.registers", time_cossin_q15_registers},
    {"clarke3_q15.registers", time_clarke3_q15_registers},
    {"clarke_bc_q15.registers", time_clarke_bc_q15_registers},
    {"clarke_ca_q15.registers", time_clarke_ca_q15_registers},
    {"atan2_q15.registers", time_atan2_q15_registers},
    {"magnitude_q15.registers", time_magnitude_q15_registers},
};

/* Half of the range that all of them take: a phase current's. */
static const struct vector_range range[ARGUMENTS_MAX] = {
    {-32767, 32767}, {-32767, 32767}, {-32767, 32767}, {-32767, 32767}};

void rows_registers(void)
{
    print_heading("kernels between two readings, arguments and results in registers");
    for (uint32_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        int32_t in[ARGUMENTS_MAX];
        int32_t out[ARGUMENTS_MAX];
        vector_restart();
        timing_begin(&rows_timing);
        for (uint32_t round = 0; round < ROUNDS; round++) {
            vector_typical(in, range, ARGUMENTS_MAX);
            timing_add_typical(&rows_timing, timing_once(rows[i].timer, in, out));
        }
        for (uint32_t k = 0; k < vector_extreme_count(ARGUMENTS_MAX); k++) {
            vector_extreme(in, range, ARGUMENTS_MAX, k);
            timing_add_extreme(&rows_timing, timing_once(rows[i].timer, in, out));
        }
        const struct timing_figures figures = timing_figures(&rows_timing);
        print_row(rows[i].name, &figures, NULL);
    }
}
