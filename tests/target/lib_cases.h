/* SPDX-License-Identifier: MIT */
/* The functions of Lib.h by number, what each must come to by its portable definition, and the vectors they are given. */
#ifndef TESTS_TARGET_LIB_CASES_H
#define TESTS_TARGET_LIB_CASES_H

#include "lib/Lib.h"
#include "lib/transform_s32.h"
#include "tests/target/random.h"

#define LIB_CASE_CORNERS 65536u  /* all of 16 corners in all four arguments */
#define LIB_CASE_VECTORS 200000u /* and random ones; what holds for all is proved: tests/prove */

enum lib_case { CASE_CLARKE, CASE_INVCLARKE, CASE_PARK, CASE_INVPARK, CASE_COUNT };

struct lib_vector {
    int32_t in[4];
};

struct lib_result {
    int32_t out[3];
};

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
            const uint32_t bits = random_next(state);

            vector.in[k] = (int32_t)bits >> ((bits ^ (bits >> 9)) & 31u);
        }
    }
    return vector;
}

static inline struct lib_result lib_case_expected(enum lib_case which, const struct lib_vector *v, uint32_t frac)
{
    const int32_t *const in = v->in;

    if (which == CASE_CLARKE) {
        return (struct lib_result){{in[0], s32_clarke_beta(in[0], in[1]), 0}};
    }
    const s32_pair_t pair = which == CASE_INVCLARKE ? s32_invclarke_bc(in[0], in[1])
                            : which == CASE_PARK    ? s32_park(in[0], in[1], in[2], in[3], frac)
                                                    : s32_invpark(in[0], in[1], in[2], in[3], frac);
    return which == CASE_INVCLARKE ? (struct lib_result){{in[0], pair.x, pair.y}}
                                   : (struct lib_result){{pair.x, pair.y, 0}};
}

/* All take words and write words: two, and InvClarke three. */
typedef void (*lib_function)(const void *in, void *out);

#define LIB_FUNCTIONS(prefix) \
    { \
        (lib_function) prefix##Clarke_Lib_Do, (lib_function)prefix##InvClarke_Lib_Do, \
            (lib_function)prefix##Park_Lib_Do, (lib_function)prefix##InvPark_Lib_Do \
    }

static inline uint32_t lib_case_results(enum lib_case which)
{
    return which == CASE_INVCLARKE ? 3u : 2u;
}

#endif
