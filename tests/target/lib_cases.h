/* SPDX-License-Identifier: MIT */
/*
 * The library's functions behind one door, and the vectors they are given. Included once in each of the builds that are
 * compared: as the firmware uses it (test_lib.c), with the assembly switched off (lib_portable.c), and on the host
 * (tests/lib/golden.c). All do the same with the same vectors, so all must come to the same checksum.
 */
#ifndef TESTS_TARGET_LIB_CASES_H
#define TESTS_TARGET_LIB_CASES_H

#include "lib/Lib.h"
#include "lib/advance.h"
#include "lib/deadtime.h"
#include "lib/limit.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/pll.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

#define LIB_CASE_CORNERS 65536u  /* all of 16 corners in all four arguments */
#define LIB_CASE_VECTORS 200000u /* and random ones; what holds for all is proved: tests/prove */

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
    CASE_PI_HOLD,
    CASE_PI_SATURATE,
    CASE_CIRCLE,
    CASE_SVM,
    CASE_SVM_MIDDLE,
    CASE_DEADTIME,
    CASE_ADVANCE,
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

static inline struct lib_result lib_case_pi(enum lib_case which, const struct lib_vector *v)
{
    switch (which) {
    case CASE_PI_HOLD:
        return (struct lib_result){{pi_q15_hold(v->in[0], v->in[1], v->in[2]),
                                    pi_q15_hold(v->in[3], v->in[2], v->in[2]),
                                    pi_q15_hold(v->in[0], v->in[3], v->in[2])}};
    case CASE_PI_SATURATE: {
        struct lib_result out = {{v->in[0], v->in[1], 0}};

        pi_q15_saturate(&out.out[0], &out.out[1], v->in[2] & INT32_MAX);
        return out;
    }
    default: {
        struct pi_q15 pi = {q15_min(v->in[0] & 32767, PI_KP_MAX_Q9), q15_min(v->in[1] & 32767, PI_KI_MAX_Q15),
                            q15_clamp(v->in[1], -(1 << 29), 1 << 29)};
        const int32_t limit = q15_clamp(v->in[2], 0, PI_OUTPUT_MAX);
        const int32_t first = pi_q15_step(&pi, q15_clamp(v->in[3], -PI_ERROR_MAX, PI_ERROR_MAX), limit);
        const int32_t second = pi_q15_step(&pi, q15_clamp(v->in[0], -PI_ERROR_MAX, PI_ERROR_MAX), limit);

        return (struct lib_result){{first, second, pi.integral_q9}};
    }
    }
}

static inline struct lib_result lib_case_modulation(enum lib_case which, const struct lib_vector *v)
{
    switch (which) {
    case CASE_CIRCLE:
        return (struct lib_result){{circle_rest_q15(q15_clamp(v->in[0], -65535, 65535), v->in[2] & 65535),
                                    polar_root_down((uint32_t)v->in[3]), polar_root((uint32_t)v->in[1])}};
    case CASE_SVM: {
        const int32_t end = (1 << 28) - 1;
        const abc_t out = svm_minmax((abc_t){q15_clamp(v->in[0], -end, end), q15_clamp(v->in[1], -end, end), v->in[2]});

        return (struct lib_result){{out.a, out.b, out.c}};
    }
    case CASE_SVM_MIDDLE: {
        const int32_t end = (1 << 29) - 1;
        const int32_t a = q15_clamp(v->in[0], -end, end), b = q15_clamp(v->in[1], -end, end);
        const int32_t c = q15_clamp(v->in[2], -end, end), d = q15_clamp(v->in[3], -end, end);

        return (struct lib_result){{svm_middle(a, b, a + b), svm_middle(c, d, c + d), svm_middle(a, c, a + c)}};
    }
    case CASE_ADVANCE: {
        struct lib_result out = {{q15_clamp(v->in[0], -65535, 65535), q15_clamp(v->in[1], -65535, 65535), 0}};

        advance_q15(&out.out[0], &out.out[1], q15_clamp(v->in[2], -ADVANCE_MAX_Q15, ADVANCE_MAX_Q15));
        return out;
    }
    default: /* the ends of the formats, and one in use */
        return (struct lib_result){
            {deadtime_share_q7(v->in[0], 0), deadtime_share_q7(v->in[1], 13), deadtime_share_q7(v->in[2], 28)}};
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
        return (struct lib_result){{q15_sat16(v->in[0]), q15_sat16(v->in[1]), q15_abs(v->in[2] | 1)}};
    case CASE_COSSIN: {
        const cossin_t out = cossin_q15((uint32_t)v->in[0]);

        return (struct lib_result){{out.cos, out.sin, 0}};
    }
    case CASE_PI:
    case CASE_PI_HOLD:
    case CASE_PI_SATURATE:
        return lib_case_pi(which, v);
    case CASE_CIRCLE:
    case CASE_SVM:
    case CASE_SVM_MIDDLE:
    case CASE_DEADTIME:
    case CASE_ADVANCE:
        return lib_case_modulation(which, v);
    case CASE_PLL: {
        struct pll pll = {(uint32_t)v->in[0], v->in[1]};

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
