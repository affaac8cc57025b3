/* SPDX-License-Identifier: MIT */
/*
 * The library under the address and undefined-behaviour sanitizers, over the ends of the stated ranges and random values:
 * nothing may overflow inside. What the results must be, the other tests here say; a checksum of them is printed, so that all
 * are computed.
 */
#include <stdio.h>

#include "lib/LibFoc.h"
#include "lib/advance.h"
#include "lib/pi.h"
#include "tests/bench/kernels.h"

#define CORNERS       14U
#define RANDOM_ROUNDS 100000U
#define WORDS         5U
#define ANY           INT32_MAX

static const int32_t corners[CORNERS] = {INT32_MIN, INT32_MIN + 1, -65536, -32768, -1,      0,       1,
                                         2,         32767,         32768,  65535,  1 << 29, 1 << 30, INT32_MAX};
static uint32_t checksum;

/* Marsaglia's xorshift (2003), of all magnitudes */
static int32_t random_i32(void)
{
    static uint32_t state = 1U;

    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return (int32_t)state >> ((state ^ (state >> 9)) & 31U);
}

static void add(const int32_t *out)
{
    for (unsigned k = 0; k < 3U; k++) {
        checksum = (checksum ^ (uint32_t)out[k]) * 0x01000193U; /* the prime of FNV-1 */
    }
}

/* Each kernel with the largest magnitude of each word, ANY for every value; a negative one: 0 to so much. */
static const struct kernel {
    void (*call)(const int32_t *in, int32_t *out);
    int32_t largest[WORDS];
} kernels[] = {
    {shipped_clarke_q15, {32768, 32768}},
    {shipped_cossin_q15, {ANY}},
    {shipped_clarke3_q15, {32768, 32768, 32768}},
    {shipped_clarke_bc_q15, {32768, 32768}},
    {shipped_clarke_ca_q15, {32768, 32768}},
    {shipped_atan2_q15, {ANY, ANY}},
    {shipped_magnitude_q15, {32768, 32768}},
    {shipped_pi_q15_step, {-PI_KP_MAX_Q9, -PI_KI_MAX_Q15, 1 << 29, PI_ERROR_MAX, -PI_OUTPUT_MAX}},
    {shipped_circle_rest_q15, {65535, -65535}},
    {shipped_svm_minmax, {(1 << 28) - 1, 1 << 28}},
    {shipped_deadtime_share_q7, {ANY}},
    {shipped_advance_q15, {65535, 65535, ADVANCE_MAX_Q15}},
    {shipped_pll_step, {ANY, ANY, ANY}},
};

/* Currents to voltages and back, at any angle: for Park and the inverses only vectors are within their ranges. */
static void chain(const int32_t *values)
{
    const int32_t i[2] = {q15_clamp(values[0], -32767, 32767), q15_clamp(values[1], -32767, 32767)};
    int32_t vector[4] = {0, 0, 0, 0}, limits[2] = {0, 32768}, out[3] = {0, 0, 0}, rest = 0;

    shipped_clarke_q15(i, vector);
    shipped_cossin_q15(&values[2], &vector[2]);
    shipped_park_q15(vector, out);
    add(out);
    limits[0] = vector[0] = q15_clamp(out[0], -32768, 32768);
    shipped_circle_rest_q15(limits, &rest);
    vector[1] = q15_clamp(out[1], -rest, rest);
    shipped_invpark_q15(vector, out);
    add(out);
    shipped_invclarke_q15(out, vector);
    add(vector);
}

static void functions(const int32_t *in)
{
    int32_t out[3] = {0, 0, 0};

    Clarke_Lib_Do((const void *)in, (void *)out), add(out);
    InvClarke_Lib_Do((const void *)in, (void *)out), add(out);
    Park_Lib_Do((const void *)in, (void *)out), add(out);
    InvPark_Lib_Do((const void *)in, (void *)out), add(out);
    Clarke3_Lib_Do((const void *)in, (void *)out), add(out);
    ClarkeBC_Lib_Do((const void *)in, (void *)out), add(out);
    ClarkeCA_Lib_Do((const void *)in, (void *)out), add(out);
    Polar_Lib_Do((const void *)in, (void *)out), add(out);
    SinCos_Lib_Do((uint32_t)in[2], (void *)out), add(out);
    SVM_Lib_Do((const void *)in, (void *)out), add(out);
    pistate_type state = {.kp_q9 = in[2], .ki_q15 = in[1], .integral_q9 = in[0]};
    PI_Lib_Do((const void *)in, &state, (void *)out), add(out);
}

static void all(const int32_t *values)
{
    functions(values);
    chain(values);
    for (unsigned n = 0; n < sizeof kernels / sizeof kernels[0]; n++) {
        int32_t in[WORDS], out[3] = {0, 0, 0};

        for (unsigned k = 0; k < WORDS; k++) {
            const int32_t end = kernels[n].largest[k];
            in[k] = end == ANY ? values[k] : end < 0 ? q15_clamp(values[k], 0, -end) : q15_clamp(values[k], -end, end);
        }
        kernels[n].call(in, out);
        add(out);
    }
}

int main(void)
{
    for (unsigned index = 0; index < CORNERS * CORNERS * CORNERS * CORNERS; index++) {
        const int32_t a = corners[index % CORNERS], b = corners[index / CORNERS % CORNERS];
        const int32_t c = corners[index / CORNERS / CORNERS % CORNERS],
                      d = corners[index / CORNERS / CORNERS / CORNERS];

        all((const int32_t[WORDS]){a, b, c, d, a ^ d});
    }
    for (unsigned n = 0; n < RANDOM_ROUNDS; n++) {
        all((const int32_t[WORDS]){random_i32(), random_i32(), random_i32(), random_i32(), random_i32()});
    }
    printf("%08lX\n", (unsigned long)checksum);
    return 0;
}
