/* SPDX-License-Identifier: MIT */
/*
 * The rest of the family under the address and undefined-behaviour sanitizers, over the ends of the stated ranges and random
 * values: nothing may overflow inside. What the results must be is tested in test_clarke3.py, test_polar.py and
 * test_pi_svm.py; here their checksum is printed, so that all are computed.
 */
#include <stdio.h>

#include "lib/LibFoc.h"
#include "lib/clarke3.h"
#include "lib/polar.h"
#include "lib/trig.h"

#define CORNERS       12U
#define RANDOM_ROUNDS 200000U

static const int32_t corners[CORNERS] = {INT32_MIN, INT32_MIN + 1, -65536, -32768, -1,      0,
                                         1,         32767,         32768,  65535,  1 << 30, INT32_MAX};
static uint32_t checksum;

static void add(int32_t value)
{
    checksum = (checksum ^ (uint32_t)value) * 0x01000193U; /* the prime of FNV-1 */
}

/* Marsaglia's xorshift (2003) */
static uint32_t random_u32(void)
{
    static uint32_t state = 1U;

    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
}

static void kernels(int32_t a, int32_t b, int32_t c)
{
    const int32_t x = q15_clamp(a, -32768, 32768);
    const int32_t y = q15_clamp(b, -32768, 32768);
    const int32_t z = q15_clamp(c, -32768, 32768);
    const alphabeta_t forms[] = {clarke3_q15((abc_t){x, y, z}), clarke_bc_q15(x, y), clarke_ca_q15(x, y)};
    const cossin_t angle = cossin_q15((uint32_t)a);

    for (unsigned k = 0; k < sizeof forms / sizeof forms[0]; k++) {
        add(forms[k].alpha);
        add(forms[k].beta);
    }
    add(angle.cos);
    add(angle.sin);
    add((int32_t)atan2_q32(a, b));
    add((int32_t)atan2_q15(b, c));
    add(polar_root((uint32_t)a));
    add(magnitude_q15(x, y));
}

static void functions(int32_t a, int32_t b, int32_t c)
{
    const clarkeinput_type in = {a, b, c};
    const polarinput_type vector = {a, b};
    clarkeoutput_type out[3];
    polaroutput_type polar;
    sincosoutput_type angle;
    pistate_type state = {.kp_q9 = c, .ki_q15 = b, .integral_q9 = a};
    pioutput_type asked;
    svmoutput_type centred;

    Clarke3_Lib_Do(&in, &out[0]);
    ClarkeBC_Lib_Do(&in, &out[1]);
    ClarkeCA_Lib_Do(&in, &out[2]);
    Polar_Lib_Do(&vector, &polar);
    SinCos_Lib_Do((uint32_t)c, &angle);
    PI_Lib_Do(&(piinput_type){a, b, c}, &state, &asked);
    SVM_Lib_Do(&(svminput_type){a, b, c}, &centred);
    add(out[0].ibeta ^ out[1].ibeta ^ out[2].ibeta);
    add(polar.magnitude);
    add(angle.sin);
    add(asked.output ^ state.integral_q9);
    add(centred.va ^ centred.vb ^ centred.vc);
}

int main(void)
{
    for (unsigned index = 0; index < CORNERS * CORNERS * CORNERS; index++) {
        const int32_t a = corners[index % CORNERS];
        const int32_t b = corners[index / CORNERS % CORNERS];
        const int32_t c = corners[index / CORNERS / CORNERS];

        kernels(a, b, c);
        functions(a, b, c);
    }
    for (unsigned n = 0; n < RANDOM_ROUNDS; n++) {
        const int32_t a = (int32_t)random_u32() >> (n % 32U);
        const int32_t b = (int32_t)random_u32() >> (n / 32U % 32U);
        const int32_t c = (int32_t)random_u32() >> (n / 1024U % 32U);

        kernels(a, b, c);
        functions(a, b, c);
    }
    printf("%08lX\n", (unsigned long)checksum);
    return 0;
}
