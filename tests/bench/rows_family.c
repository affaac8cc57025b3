/* SPDX-License-Identifier: MIT */
/* The functions of LibFoc.h, called over the whole range of their arguments. */
#include <stddef.h>

#include "lib/LibFoc.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define ARGUMENTS 3u

TIMING_FUNCTION(time_clarke3, Clarke3_Lib_Do(in, out))
TIMING_FUNCTION(time_clarke_bc, ClarkeBC_Lib_Do(in, out))
TIMING_FUNCTION(time_clarke_ca, ClarkeCA_Lib_Do(in, out))
TIMING_FUNCTION(time_sincos, SinCos_Lib_Do(*(const uint32_t *)in, out))
TIMING_FUNCTION(time_polar, Polar_Lib_Do(in, out))

static const struct {
    const char *name;
    timer_function timer;
} rows[] = {
    {"Clarke3_Lib_Do", time_clarke3}, {"ClarkeBC_Lib_Do", time_clarke_bc}, {"ClarkeCA_Lib_Do", time_clarke_ca},
    {"SinCos_Lib_Do", time_sincos},   {"Polar_Lib_Do", time_polar},
};

static const struct vector_range typical[ARGUMENTS] = {{-100000, 100000}, {-100000, 100000}, {-100000, 100000}};
static const struct vector_range any[ARGUMENTS] = {
    {INT32_MIN, INT32_MAX}, {INT32_MIN, INT32_MAX}, {INT32_MIN, INT32_MAX}};

void rows_family(void)
{
    print_heading("the rest of the library: call and return included");
    for (uint32_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        int32_t in[ARGUMENTS];
        int32_t out[ARGUMENTS];
        vector_restart();
        timing_begin(&rows_timing);
        for (uint32_t k = 0; k < TIMING_TYPICAL; k++) {
            vector_typical(in, typical, ARGUMENTS);
            timing_add_typical(&rows_timing, timing_once(rows[i].timer, in, out));
        }
        for (uint32_t k = 0; k < vector_extreme_count(ARGUMENTS); k++) {
            vector_extreme(in, any, ARGUMENTS, k);
            timing_add_extreme(&rows_timing, timing_once(rows[i].timer, in, out));
        }
        const struct timing_figures figures = timing_figures(&rows_timing);
        print_row(rows[i].name, &figures, NULL);
    }
}
