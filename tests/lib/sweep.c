/* SPDX-License-Identifier: MIT */
/*
 * The library under the address and undefined-behaviour sanitizers: corners of every argument and random values, Lib.h
 * against exact 128-bit arithmetic, the Q15 kernels over their stated ranges so that an overflow inside is caught.
 * Prints one line a function and ends with 1 on the first deviation.
 */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "lib/Lib.h"
#include "lib/advance.h"
#include "lib/deadtime.h"
#include "lib/limit.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/pll.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

__extension__ typedef __int128 wide_t;

/* Lib.h's bounds, in thousandths of an LSB */
#define CLARKE_THOUSANDTHS    583
#define INVCLARKE_THOUSANDTHS 621

#define RANDOM_VECTORS 100000
#define COUNT(table)   (sizeof(table) / sizeof((table)[0]))

static const int32_t corners[] = {INT32_MIN, INT32_MIN + 1, -65536, -32769, -32768,        -2,       -1, 0, 1, 2,
                                  16384,     32767,         32768,  65535,  INT32_MAX - 1, INT32_MAX};

/* SplitMix64 (G. Steele, D. Lea, C. Flood, 2014) */
static uint64_t random_state = 1;

static uint64_t random_u64(void)
{
    uint64_t z = (random_state += 0x9E3779B97F4A7C15U);

    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
}

/* All magnitudes alike, not only the huge ones. */
static int32_t random_i32(void)
{
    const uint64_t bits = random_u64();

    return (int32_t)(uint32_t)bits >> ((bits >> 32) % 32U);
}

/* -limit...limit */
static int32_t random_within(int32_t limit)
{
    return (int32_t)((int64_t)(random_u64() % (2U * (uint64_t)limit + 1U)) - limit);
}

static void check(bool good, const char *what, const int32_t *in, size_t count)
{
    if (!good) {
        printf("%s is wrong for", what);
        for (size_t k = 0; k < count; k++) {
            printf(" %ld", (long)in[k]);
        }
        printf("\n");
        exit(1);
    }
}

static int32_t saturated(wide_t value)
{
    return (int32_t)(value > INT32_MAX ? INT32_MAX : value < INT32_MIN ? INT32_MIN : value);
}

/* sum / 2^LIB_TRIG_FRAC, nearest, ties up, saturated */
static int32_t rounded(wide_t sum)
{
    const wide_t one = (wide_t)1 << LIB_TRIG_FRAC;
    const wide_t shifted = 2 * sum + one;
    wide_t quotient = shifted / (2 * one);

    if (shifted % (2 * one) < 0) {
        quotient--;
    }
    return saturated(quotient);
}

/* p <= sqrt(3) q */
static bool at_most_sqrt3(wide_t p, wide_t q)
{
    if (p >= 0 && q >= 0) {
        return p * p <= 3 * q * q;
    }
    if (p < 0 && q < 0) {
        return p * p >= 3 * q * q;
    }
    return p < 0;
}

/* |(n sqrt(3) + m) / 2 - result| <= thousandths / 1000, or saturated as it should be */
static bool near_half_sqrt3(wide_t n, wide_t m, int32_t result, wide_t thousandths)
{
    const wide_t middle = 2000 * (wide_t)result - 1000 * m;
    const bool not_below = at_most_sqrt3(middle - 2 * thousandths, 1000 * n); /* result - tolerance <= exact */
    const bool not_above = at_most_sqrt3(-middle - 2 * thousandths, -1000 * n);

    return (not_below || result == INT32_MIN) && (not_above || result == INT32_MAX);
}

static void check_clarke(const int32_t in[2])
{
    const clarkeinput_type input = {in[0], in[1], (int32_t)random_u64()};
    clarkeoutput_type output;

    Clarke_Lib_Do(&input, &output);
    /* (a + 2 b) / sqrt(3) = 2/3 (a + 2 b) sqrt(3) / 2: all times 3 */
    const wide_t sum = (wide_t)in[0] + 2 * (wide_t)in[1];
    const wide_t middle = 3000 * (wide_t)output.ibeta;
    const bool not_below = at_most_sqrt3(middle - 3 * CLARKE_THOUSANDTHS, 1000 * sum);
    const bool not_above = at_most_sqrt3(-middle - 3 * CLARKE_THOUSANDTHS, -1000 * sum);
    const bool good = (not_below || output.ibeta == INT32_MIN) && (not_above || output.ibeta == INT32_MAX);

    check(output.ialpha == in[0] && good, "Clarke", in, 2);
}

static void check_invclarke(const int32_t in[2])
{
    const invclarkeinput_type input = {in[0], in[1]};
    invclarkeoutput_type output;

    InvClarke_Lib_Do(&input, &output);
    check(output.va == in[0] && near_half_sqrt3(in[1], -(wide_t)in[0], output.vb, INVCLARKE_THOUSANDTHS) &&
              near_half_sqrt3(-(wide_t)in[1], -(wide_t)in[0], output.vc, INVCLARKE_THOUSANDTHS),
          "InvClarke", in, 2);
}

static void check_park(const int32_t in[4])
{
    const parkinput_type forward = {in[0], in[1], in[2], in[3]};
    const invparkinput_type backward = {in[0], in[1], in[2], in[3]};
    const wide_t x = in[0], y = in[1], c = in[2], s = in[3];
    parkoutput_type rotor;
    invparkoutput_type stationary;

    Park_Lib_Do(&forward, &rotor);
    check(rotor.id == rounded(x * c + y * s) && rotor.iq == rounded(y * c - x * s), "Park", in, 4);
    InvPark_Lib_Do(&backward, &stationary);
    check(stationary.valpha == rounded(x * c - y * s) && stationary.vbeta == rounded(y * c + x * s), "InvPark", in, 4);
}

/* Each of `count` arguments through all corners. */
static void all_corners(void (*function)(const int32_t *), size_t count)
{
    size_t total = 1;

    for (size_t k = 0; k < count; k++) {
        total *= COUNT(corners);
    }
    for (size_t index = 0; index < total; index++) {
        int32_t in[4] = {0};
        size_t rest = index;

        for (size_t k = 0; k < count; k++) {
            in[k] = corners[rest % COUNT(corners)];
            rest /= COUNT(corners);
        }
        function(in);
    }
}

static void sweep(const char *name, void (*function)(const int32_t *), size_t count)
{
    all_corners(function, count);
    for (int n = 0; n < RANDOM_VECTORS; n++) {
        const int32_t in[4] = {random_i32(), random_i32(), random_i32(), random_i32()};

        function(in);
    }
    printf("%s ok\n", name);
}

/* Currents to voltages and back through every Q15 kernel, extremes of the stated ranges included. */
static void check_chain(const int32_t in[4])
{
    const int32_t a = q15_clamp(in[0], -32767, 32767);
    const int32_t b = q15_clamp(in[1], -32767, 32767);
    const cossin_t angle = cossin_q15((uint32_t)in[2]);
    const dq_t i = park_q15(clarke_q15(a, b), angle);
    const int32_t radius = q15_clamp(in[3], 0, 32768);
    const int32_t v_d = q15_clamp(i.d, -radius, radius);
    const int32_t rest = circle_rest_q15(v_d, radius);
    const dq_t v = {v_d, q15_clamp(i.q, -rest, rest)};
    const abc_t phase = invclarke_q15(invpark_q15(v, angle));
    const abc_t out = svm_minmax(phase);
    const int32_t largest = q15_max(q15_max(q15_abs(out.a), q15_abs(out.b)), q15_abs(out.c));
    const int32_t share = deadtime_share_q7(in[0], (uint32_t)in[2] % 29U);

    check(phase.a + phase.b + phase.c == 0, "InvClarke Q15's sum", in, 4);
    /* sqrt(3)/2 of the radius, 28378 / 32768, and what three roundings add */
    check(largest <= radius * 28378 / 32768 + 4, "svm_minmax", in, 4);
    check(share >= -DEADTIME_FULL && share < DEADTIME_FULL, "dead time", in, 4);
}

/* The range's ends stand for all else: sums and shifts only. */
static void check_svm_range(const int32_t in[4])
{
    const abc_t v = {q15_clamp(in[0], -(1 << 28) + 1, (1 << 28) - 1), q15_clamp(in[1], -(1 << 28), (1 << 28) - 1),
                     in[2]};
    const abc_t out = svm_minmax(v);
    const int32_t a = q15_clamp(in[0], -(1 << 29) + 1, (1 << 29) - 1);
    const int32_t b = q15_clamp(in[1], -(1 << 29) + 1, (1 << 29) - 1);

    check(out.a - out.b == v.a - v.b && out.b - out.c == v.a + 2 * v.b, "svm_minmax line to line", in, 4);
    check(q15_abs(svm_middle(a, b, a + b)) <= 1 << 28, "svm_middle", in, 4); /* of three with sum 0 */
}

static void check_advance(const int32_t in[4])
{
    const int32_t larger = q15_max(q15_abs(q15_clamp(in[0], -65535, 65535)), q15_abs(q15_clamp(in[1], -65535, 65535)));
    int32_t x = q15_clamp(in[0], -65535, 65535);
    int32_t y = q15_clamp(in[1], -65535, 65535);

    advance_q15(&x, &y, q15_clamp(in[2], -ADVANCE_MAX_Q15, ADVANCE_MAX_Q15));
    check(10 * q15_max(q15_abs(x), q15_abs(y)) <= 16 * larger + 10, "advance", in, 4);
}

static void check_controllers(const int32_t in[4])
{
    static struct pll pll;
    struct pi_q15 pi = {q15_clamp(in[0], 0, PI_KP_MAX_Q9), q15_clamp(in[1], 0, PI_KI_MAX_Q15), 0};
    const int32_t limit = q15_min(q15_abs(in[1] | 1), PI_OUTPUT_MAX);
    const int32_t error = q15_clamp(in[3], -PI_ERROR_MAX, PI_ERROR_MAX);
    const int32_t farthest = (32768 << 9) + ((pi.ki_q15 * PI_ERROR_MAX) >> 6) + 1;

    pi.integral_q9 = q15_clamp(in[2], -(32768 << 9), 32768 << 9);
    for (int n = 0; n < 3; n++) {
        check(q15_abs(pi_q15_step(&pi, error, limit)) <= limit && q15_abs(pi.integral_q9) <= farthest, "PI", in, 4);
    }
    pi.integral_q9 = q15_clamp(in[2], -(1 << 29), 1 << 29); /* as far as additions may take it */
    check(q15_abs(pi_q15_step(&pi, error, limit)) <= limit, "PI far outside", in, 4);
    pll.speed_q32 = in[0];
    pll_step(&pll, (uint32_t)in[3]); /* any state, any angle: only that it does not overflow */
}

static void check_q15(const int32_t in[4])
{
    check_chain(in);
    check_svm_range(in);
    check_advance(in);
    check_controllers(in);
}

static void sweep_chain(void)
{
    all_corners(check_q15, 4);
    for (int n = 0; n < RANDOM_VECTORS; n++) {
        const int32_t in[4] = {random_within(33000), random_within(33000), random_i32(), random_within(33000)};

        check_q15(in);
    }
    for (uint32_t angle = 0; angle < 65536U; angle++) { /* the longest vector there is, at every angle */
        const int32_t in[4] = {32767, 32767, (int32_t)(angle << 16), 32768};

        check_chain(in);
    }
    printf("Q15 ok\n");
}

int main(void)
{
    sweep("Clarke", check_clarke, 2);
    sweep("InvClarke", check_invclarke, 2);
    sweep("Park, InvPark", check_park, 4);
    sweep_chain();
    return 0;
}
