/* SPDX-License-Identifier: MIT */
/*
 * The kernels in registers, as in the middle of a loop: between the two readings there is nothing but the kernel, whose
 * arguments are in registers before and whose results are in registers after. The kernel runs once before, so that constants
 * may be in registers too.
 */
#include <stddef.h>

#include "lib/clarke3.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/polar.h"
#include "lib/trig.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define ARGUMENTS_MAX 4u

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

/* The compiler may neither know a value nor compute it elsewhere than here. */
#define IN_REGISTER(value) __asm volatile("" : "+r"(value))

static __attribute__((noinline, aligned(8))) uint32_t time_pi_q15_step_registers(const void *in, void *out)
{
    const int32_t *const word = in;
    struct pi_q15 pi = {word[0], word[1], word[2]};
    int32_t error = word[3], limit = word[4];

    IN_REGISTER(pi.kp_q9);
    IN_REGISTER(pi.ki_q15);
    IN_REGISTER(pi.integral_q9);
    IN_REGISTER(error);
    IN_REGISTER(limit);
    const uint32_t start = dwt_cycles();
    IN_REGISTER(error);
    IN_REGISTER(pi.integral_q9);
    int32_t output = pi_q15_step(&pi, error, limit);
    IN_REGISTER(output);
    IN_REGISTER(pi.integral_q9);
    const uint32_t counted = dwt_cycles() - start;
    ((int32_t *)out)[0] = output;
    ((int32_t *)out)[1] = pi.integral_q9;
    return counted;
}

static __attribute__((noinline, aligned(8))) uint32_t time_svm_minmax_registers(const void *in, void *out)
{
    const int32_t *const word = in;
    abc_t v = {.a = word[0], .b = word[1]};

    IN_REGISTER(v.a);
    IN_REGISTER(v.b);
    const uint32_t start = dwt_cycles();
    IN_REGISTER(v.a);
    IN_REGISTER(v.b);
    abc_t result = svm_minmax(v);
    IN_REGISTER(result.a);
    IN_REGISTER(result.b);
    IN_REGISTER(result.c);
    const uint32_t counted = dwt_cycles() - start;
    *(abc_t *)out = result;
    return counted;
}

static const struct vector_range range_pi[] = {
    {0, 16384}, {0, 21845}, {-(1 << 25), 1 << 25}, {-98303, 98303}, {0, 32766}};
static const struct vector_range range_svm[] = {{-(1 << 28), 1 << 28}, {-(1 << 28), 1 << 28}};

static void row(const char *name, timer_function timer, const struct vector_range *ranges, uint32_t words)
{
    const struct timing_figures figures = rows_over_vectors(timer, ranges, ranges, words);
    print_row(name, &figures, NULL);
}

void rows_registers(void)
{
    print_heading("kernels between two readings, arguments and results in registers");
    for (uint32_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        row(rows[i].name, rows[i].timer, range, ARGUMENTS_MAX);
    }
    row("pi_q15_step.registers", time_pi_q15_step_registers, range_pi, 5u);
    row("svm_minmax.registers", time_svm_minmax_registers, range_svm, 2u);
}
