/* SPDX-License-Identifier: MIT */
/* Each kernel that has inline assembly, behind a number. lib_portable.c includes it with the assembly switched off. */
#ifndef TESTS_TARGET_LIB_INLINE_H
#define TESTS_TARGET_LIB_INLINE_H

#include "lib/deadtime.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "tests/target/lib_cases.h"

#define LIB_INLINE_COUNT 5u

static inline struct lib_result lib_inline(uint32_t which, const int32_t in[4])
{
    const int32_t end = (1 << 29) - 1;
    const int32_t a = q15_clamp(in[0], -end, end), b = q15_clamp(in[1], -end, end), c = q15_clamp(in[2], -end, end);
    struct lib_result out = {{in[0], in[1], 0}};

    switch (which) {
    case 0:
        return (struct lib_result){{q15_sat16(in[0]), q15_sat16(in[1]), q15_abs(in[2] | 1)}};
    case 1:
        return (struct lib_result){
            {pi_q15_hold(in[0], in[1], in[2]), pi_q15_hold(in[3], in[2], in[2]), pi_q15_hold(in[0], in[3], in[2])}};
    case 2:
        pi_q15_saturate(&out.out[0], &out.out[1], in[2] & INT32_MAX);
        return out;
    case 3:
        return (struct lib_result){{svm_middle(a, b, a + b), svm_middle(b, c, b + c), svm_middle(a, c, a + c)}};
    default: /* the ends of the formats, and one in use */
        return (struct lib_result){
            {deadtime_share_q7(in[0], 0), deadtime_share_q7(in[1], 13), deadtime_share_q7(in[2], 28)}};
    }
}

struct lib_result lib_portable(uint32_t which, const int32_t in[4]);

#endif
