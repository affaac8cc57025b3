/* SPDX-License-Identifier: MIT */
/*
 * The controllers' kernels in registers: arguments are there before the first reading of CYCCNT, results before the second.
 * What a kernel costs where the compiler has put it into its caller.
 */
#include <stddef.h>

#include "lib/modulation.h"
#include "lib/pi.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define WORDS_MAX 5u

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
    int32_t in[WORDS_MAX];
    int32_t out[WORDS_MAX];
    vector_restart();
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        vector_typical(in, ranges, words);
        timing_add_typical(&rows_timing, timing_once(timer, in, out));
    }
    for (uint32_t i = 0; i < vector_extreme_count(words); i++) {
        vector_extreme(in, ranges, words, i);
        timing_add_extreme(&rows_timing, timing_once(timer, in, out));
    }
    const struct timing_figures figures = timing_figures(&rows_timing);
    print_row(name, &figures, NULL);
}

void rows_control(void)
{
    print_heading("in registers: from arguments in registers to results in registers");
    row("pi_q15_step.registers", time_pi_q15_step_registers, range_pi, 5u);
    row("svm_minmax.registers", time_svm_minmax_registers, range_svm, 2u);
}
