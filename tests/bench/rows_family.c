/* SPDX-License-Identifier: MIT */
/* The functions of LibFoc.h, called over the whole range of their arguments. */
#include <stddef.h>

#include "lib/LibFoc.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define ARGUMENTS_MAX 6u

TIMING_FUNCTION(time_clarke3, Clarke3_Lib_Do(in, out))
TIMING_FUNCTION(time_clarke_bc, ClarkeBC_Lib_Do(in, out))
TIMING_FUNCTION(time_clarke_ca, ClarkeCA_Lib_Do(in, out))
TIMING_FUNCTION(time_sincos, SinCos_Lib_Do(*(const uint32_t *)in, out))
TIMING_FUNCTION(time_polar, Polar_Lib_Do(in, out))
TIMING_FUNCTION(time_pi, PI_Lib_Do(in, (pistate_type *)((int32_t *)in + 3), out))
TIMING_FUNCTION(time_svm, SVM_Lib_Do(in, out))

static const struct {
    const char *name;
    timer_function timer;
    uint32_t words;
} rows[] = {
    {"Clarke3_Lib_Do", time_clarke3, 3}, {"ClarkeBC_Lib_Do", time_clarke_bc, 3}, {"ClarkeCA_Lib_Do", time_clarke_ca, 3},
    {"SinCos_Lib_Do", time_sincos, 3},   {"Polar_Lib_Do", time_polar, 3},        {"PI_Lib_Do", time_pi, 6},
    {"SVM_Lib_Do", time_svm, 3},
};

#define TYPICAL ((struct vector_range){-100000, 100000})
#define ANY     ((struct vector_range){INT32_MIN, INT32_MAX})
static const struct vector_range typical[ARGUMENTS_MAX] = {TYPICAL, TYPICAL, TYPICAL, TYPICAL, TYPICAL, TYPICAL};
static const struct vector_range any[ARGUMENTS_MAX] = {ANY, ANY, ANY, ANY, ANY, ANY};

void rows_family(void)
{
    print_heading("the rest of the library: call and return included");
    for (uint32_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const struct timing_figures figures = rows_over_vectors(rows[i].timer, typical, any, rows[i].words);
        print_row(rows[i].name, &figures, NULL);
    }
}
