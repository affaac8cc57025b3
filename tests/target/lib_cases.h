/* SPDX-License-Identifier: MIT */
/*
 * The library's functions behind one door, and the vectors they are given. Included once in each of the builds that are
 * compared: as the firmware uses it (test_lib.c), with the assembly switched off (lib_portable.c), and on the host
 * (tests/lib/golden.c). All do the same with the same vectors, so all must come to the same checksum.
 */
#ifndef TESTS_TARGET_LIB_CASES_H
#define TESTS_TARGET_LIB_CASES_H

#include "lib/Lib.h"
#include "lib/deadtime.h"
#include "lib/limit.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/pll.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

#define LIB_CASE_CORNERS 65536u   /* all of 16 corners in all four arguments */
#define LIB_CASE_VECTORS 1065536u /* and a million random ones */

enum lib_case {
    CASE_CLARKE,
    CASE_INVCLARKE,
    CASE_PARK,
    CASE_INVPARK,
    CASE_SATURATIONS,
    CASE_CLARKE_Q15,
    CASE_INVCLARKE_Q15,
    CASE_PARK_Q15,
    CASE_INVPARK_Q15,
    CASE_COSSIN,
    CASE_PI,
    CASE_CIRCLE,
    CASE_SVM,
    CASE_RECIPROCAL,
    CASE_DEADTIME,
    CASE_PLL,
    CASE_COUNT
};

struct lib_vector {
    int32_t in[4];
};

struct lib_result {
    int32_t out[3];
};

/* Marsaglia's xorshift (2003), period 2^32 - 1; the state is never 0. */
static inline uint32_t lib_case_random(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

/* First all combinations of corners, then random values of all magnitudes. */
static inline struct lib_vector lib_case_vector(uint32_t index, uint32_t *state)
{
    static const int32_t corners[16] = {INT32_MIN, INT32_MIN + 1, -65536, -32768, -32767, -16384,        -1,       0, 1,
                                        2,         16384,         32767,  32768,  65535,  INT32_MAX - 1, INT32_MAX};
    struct lib_vector vector;

    for (uint32_t k = 0; k < 4u; k++) {
        if (index < LIB_CASE_CORNERS) {
            vector.in[k] = corners[(index >> (4u * k)) & 15u];
        } else {
            const uint32_t bits = lib_case_random(state);

            vector.in[k] = (int32_t)bits >> ((bits ^ (bits >> 9)) & 31u);
        }
    }
    return vector;
}

static inline uint32_t lib_case_checksum(uint32_t sum, const struct lib_result *result)
{
    for (uint32_t k = 0; k < 3u; k++) {
        sum = (sum ^ (uint32_t)result->out[k]) * 0x01000193u; /* the prime of FNV-1 */
        sum = (sum << 15) | (sum >> 17);
    }
    return sum;
}

static inline struct lib_result lib_case_api(enum lib_case which, const struct lib_vector *v)
{
    switch (which) {
    case CASE_CLARKE: {
        const clarkeinput_type in = {v->in[0], v->in[1], v->in[2]};
        clarkeoutput_type out;

        Clarke_Lib_Do(&in, &out);
        return (struct lib_result){{out.ialpha, out.ibeta, 0}};
    }
    case CASE_INVCLARKE: {
        const invclarkeinput_type in = {v->in[0], v->in[1]};
        invclarkeoutput_type out;

        InvClarke_Lib_Do(&in, &out);
        return (struct lib_result){{out.va, out.vb, out.vc}};
    }
    case CASE_PARK: {
        const parkinput_type in = {v->in[0], v->in[1], v->in[2], v->in[3]};
        parkoutput_type out;

        Park_Lib_Do(&in, &out);
        return (struct lib_result){{out.id, out.iq, 0}};
    }
    default: {
        const invparkinput_type in = {v->in[0], v->in[1], v->in[2], v->in[3]};
        invparkoutput_type out;

        InvPark_Lib_Do(&in, &out);
        return (struct lib_result){{out.valpha, out.vbeta, 0}};
    }
    }
}

static inline struct lib_result lib_case_transform_q15(enum lib_case which, const struct lib_vector *v)
{
    const int32_t x = q15_clamp(v->in[0], -32767, 32767);
    const int32_t y = q15_clamp(v->in[1], -32767, 32767);
    const cossin_t angle = cossin_q15((uint32_t)v->in[2]);

    switch (which) {
    case CASE_CLARKE_Q15: {
        const alphabeta_t out = clarke_q15(x, y);

        return (struct lib_result){{out.alpha, out.beta, 0}};
    }
    case CASE_INVCLARKE_Q15: {
        const abc_t out = invclarke_q15((alphabeta_t){x, y});

        return (struct lib_result){{out.a, out.b, out.c}};
    }
    case CASE_PARK_Q15: {
        const dq_t out = park_q15(clarke_q15(x, y), angle);

        return (struct lib_result){{out.d, out.q, 0}};
    }
    default: {
        const alphabeta_t out = invpark_q15((dq_t){x, y}, angle);

        return (struct lib_result){{out.alpha, out.beta, 0}};
    }
    }
}

static inline struct lib_result lib_case_pi(const struct lib_vector *v)
{
    struct pi_q15 pi = {v->in[0] & 32767, v->in[1] & 32767, 0};
    const int32_t limit = q15_clamp(v->in[2], 0, 32768);

    pi_q15_preset(&pi, q15_clamp(v->in[0], -32768, 32768), q15_clamp(v->in[3], -32768, 32768));
    const int32_t first = pi_q15_step(&pi, v->in[3], q15_clamp(v->in[1], -65536, 65536), limit);
    const int32_t second = pi_q15_step(&pi, v->in[0], 0, limit);

    return (struct lib_result){{first, second, pi.integral_q30}};
}

static inline struct lib_result lib_case_modulation(enum lib_case which, const struct lib_vector *v)
{
    switch (which) {
    case CASE_CIRCLE: {
        const dq_t out = circle_limit_q15(
            (dq_t){q15_clamp(v->in[0], -65535, 65535), q15_clamp(v->in[1], -65535, 65535)}, v->in[2] & 65535);

        return (struct lib_result){{out.d, out.q, (int32_t)limit_root((uint32_t)v->in[3])}};
    }
    case CASE_SVM: {
        const abc_t out = svm_minmax_q15((abc_t){q15_clamp(v->in[0], -11000, 11000), q15_clamp(v->in[1], -11000, 11000),
                                                 q15_clamp(v->in[2], -11000, 11000)},
                                         q15_clamp(v->in[3], 16384, 65536));

        return (struct lib_result){{out.a, out.b, out.c}};
    }
    case CASE_RECIPROCAL:
        return (struct lib_result){
            {recip_q14_refine(q15_clamp(v->in[0], 4, RECIP_MAX_Q14), q15_clamp(v->in[1], 0, 32767)), 0, 0}};
    default:
        return (struct lib_result){{deadtime_comp(v->in[0], v->in[1] & 32767, 1u + ((uint32_t)v->in[2] & 7u)), 0, 0}};
    }
}

static inline struct lib_result lib_case_run(enum lib_case which, const struct lib_vector *v)
{
    switch (which) {
    case CASE_CLARKE:
    case CASE_INVCLARKE:
    case CASE_PARK:
    case CASE_INVPARK:
        return lib_case_api(which, v);
    case CASE_SATURATIONS:
        return (struct lib_result){{q15_sat16(v->in[0]), q15_unsigned_from_q30(v->in[1]), q15_abs(v->in[2] | 1)}};
    case CASE_COSSIN: {
        const cossin_t out = cossin_q15((uint32_t)v->in[0]);

        return (struct lib_result){{out.cos, out.sin, 0}};
    }
    case CASE_PI:
        return lib_case_pi(v);
    case CASE_CIRCLE:
    case CASE_SVM:
    case CASE_RECIPROCAL:
    case CASE_DEADTIME:
        return lib_case_modulation(which, v);
    case CASE_PLL: {
        struct pll pll = {(uint32_t)v->in[0], v->in[1], v->in[2] & 65535, v->in[3] & 65535};

        pll_step(&pll, (uint32_t)v->in[2]);
        return (struct lib_result){{(int32_t)pll.angle_q32, pll.speed_q32, 0}};
    }
    default:
        return lib_case_transform_q15(which, v);
    }
}

/* The same built from the portable definitions. */
struct lib_result lib_case_portable(enum lib_case which, const struct lib_vector *v);

#endif
