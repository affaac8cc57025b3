/* SPDX-License-Identifier: MIT */
#include "lib/Lib.h"
#include "tests/bench/kernels.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

void o2_Clarke_Lib_Do(const clarkeinput_type *in, clarkeoutput_type *out);
void o2_InvClarke_Lib_Do(const invclarkeinput_type *in, invclarkeoutput_type *out);
void o2_Park_Lib_Do(const parkinput_type *in, parkoutput_type *out);
void o2_InvPark_Lib_Do(const invparkinput_type *in, invparkoutput_type *out);
void o3_Clarke_Lib_Do(const clarkeinput_type *in, clarkeoutput_type *out);
void o3_InvClarke_Lib_Do(const invclarkeinput_type *in, invclarkeoutput_type *out);
void o3_Park_Lib_Do(const parkinput_type *in, parkoutput_type *out);
void o3_InvPark_Lib_Do(const invparkinput_type *in, invparkoutput_type *out);

#define LIB_TIMERS(name, reads, writes) \
    TIMING_FUNCTION(time_shipped_##name, name(in, out)) \
    TIMING_FUNCTION(time_o2_##name, o2_##name(in, out)) \
    TIMING_FUNCTION(time_o3_##name, o3_##name(in, out)) \
    TIMING_FUNCTION(time_moves_##name, moves_##name(in, out))
#define KERNEL_TIMERS(name, reads, writes) \
    TIMING_FUNCTION(time_shipped_##name, shipped_##name(in, out)) \
    TIMING_FUNCTION(time_o2_##name, o2_##name(in, out)) \
    TIMING_FUNCTION(time_o3_##name, o3_##name(in, out)) \
    TIMING_FUNCTION(time_moves_##name, moves_##name(in, out))

BENCH_LIB_FUNCTIONS(LIB_TIMERS)
BENCH_KERNELS(KERNEL_TIMERS)

struct kernel_row {
    const char *name;
    timer_function shipped, o2, o3, moves;
    uint32_t words;
    const struct vector_range *typical, *extreme;
};

#define ANY                 ((struct vector_range){INT32_MIN, INT32_MAX})
#define SYMMETRIC(limit)    ((struct vector_range){-(limit), (limit)})
#define RANGES(kernel, ...) static const struct vector_range kernel[] = {__VA_ARGS__};
#define LIB_CURRENT         SYMMETRIC(100000)
#define LIB_FRACTION        SYMMETRIC(1 << LIB_TRIG_FRAC)
#define Q15_CURRENT         SYMMETRIC(32767)
#define Q15_FRACTION        SYMMETRIC(32768)

/* Lib.h takes anything, but in a drive it gets currents in milliampere and points of the unit circle. */
RANGES(typical_two, LIB_CURRENT, LIB_CURRENT)
RANGES(typical_four, LIB_CURRENT, LIB_CURRENT, LIB_FRACTION, LIB_FRACTION)
RANGES(any_four, ANY, ANY, ANY, ANY)
/* The kernels are defined within these ranges only. */
RANGES(range_two, Q15_CURRENT, Q15_CURRENT)
RANGES(range_four, Q15_CURRENT, Q15_CURRENT, Q15_FRACTION, Q15_FRACTION)
RANGES(range_three, Q15_CURRENT, Q15_CURRENT, Q15_CURRENT)
RANGES(range_pi, {0, 16384}, {0, 21845}, SYMMETRIC(1 << 25), SYMMETRIC(98303), {0, 32766})
RANGES(range_rest, SYMMETRIC(65535), {0, 65535})
RANGES(range_svm, SYMMETRIC(1 << 28), SYMMETRIC(1 << 28))
RANGES(range_advance, SYMMETRIC(65535), SYMMETRIC(65535), SYMMETRIC(19660))

/* clang-format off */
#define ROW(name, words, typical, extreme) \
    {#name, time_shipped_##name, time_o2_##name, time_o3_##name, time_moves_##name, words, typical, extreme}

static const struct kernel_row kernel_rows[] = {
    ROW(Clarke_Lib_Do, 2, typical_two, any_four),
    ROW(Park_Lib_Do, 4, typical_four, any_four),
    ROW(InvPark_Lib_Do, 4, typical_four, any_four),
    ROW(InvClarke_Lib_Do, 2, typical_two, any_four),
    ROW(clarke_q15, 2, range_two, range_two),
    ROW(park_q15, 4, range_four, range_four),
    ROW(invpark_q15, 4, range_four, range_four),
    ROW(invclarke_q15, 2, range_two, range_two),
    ROW(cossin_q15, 1, any_four, any_four),
    ROW(clarke3_q15, 3, range_three, range_three),
    ROW(clarke_bc_q15, 2, range_two, range_two),
    ROW(clarke_ca_q15, 2, range_two, range_two),
    ROW(atan2_q15, 2, range_two, any_four),
    ROW(magnitude_q15, 2, range_two, range_two),
    ROW(pi_q15_step, 5, range_pi, range_pi),
    ROW(circle_rest_q15, 2, range_rest, range_rest),
    ROW(svm_minmax, 2, range_svm, range_svm),
    ROW(deadtime_share_q7, 1, any_four, any_four),
    ROW(advance_q15, 3, range_advance, range_advance),
    ROW(pll_step, 3, any_four, any_four),
};
/* clang-format on */

/* All builds get the same data. */
static struct timing_figures measure(const struct kernel_row *row, timer_function timer)
{
    return rows_over_vectors(timer, row->typical, row->extreme, row->words);
}

void rows_arithmetic(void)
{
    print_heading("library: call and return included; moves: the same call without its arithmetic;"
                  " O2, O3: the portable C");
    for (uint32_t i = 0; i < sizeof kernel_rows / sizeof kernel_rows[0]; i++) {
        const struct kernel_row *const row = &kernel_rows[i];
        const struct timing_figures shipped = measure(row, row->shipped);
        const struct print_comparison comparison = {
            .moves = measure(row, row->moves).median,
            .o2 = measure(row, row->o2),
            .o3 = measure(row, row->o3),
        };
        print_row(row->name, &shipped, &comparison);
    }
}
