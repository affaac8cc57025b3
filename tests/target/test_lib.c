/* SPDX-License-Identifier: MIT */
/*
 * The library on the target: each function against its portable definition, bit for bit, and against the checksum that
 * the host comes to (tests/lib/test_golden.py), over all corners and a million random vectors.
 */
#include "drivers/mss/watchdog.h"
#include "tests/target/harness.h"
#include "tests/target/lib_cases.h"
#include "tests/target/lib_golden.h"

#define VECTORS_PER_REFRESH 4096u

struct outcome {
    uint32_t checksum;
    uint32_t differing;   /* vectors on which the two builds differ */
    uint32_t first_index; /* of them */
};

static bool equal(const struct lib_result *x, const struct lib_result *y)
{
    return x->out[0] == y->out[0] && x->out[1] == y->out[1] && x->out[2] == y->out[2];
}

static struct outcome compare(enum lib_case which)
{
    struct outcome outcome = {0u, 0u, 0u};
    uint32_t state = 1u + (uint32_t)which;

    for (uint32_t index = 0; index < LIB_CASE_VECTORS; index++) {
        const struct lib_vector vector = lib_case_vector(index, &state);
        const struct lib_result result = lib_case_run(which, &vector);
        const struct lib_result portable = lib_case_portable(which, &vector);

        if (!equal(&result, &portable)) {
            outcome.first_index = outcome.differing == 0u ? index : outcome.first_index;
            outcome.differing++;
        }
        outcome.checksum = lib_case_checksum(outcome.checksum, &result);
        if (index % VECTORS_PER_REFRESH == 0u) {
            watchdog_refresh();
        }
    }
    return outcome;
}

int main(void)
{
    (void)harness_begin();
    for (uint32_t which = 0; which < CASE_COUNT; which++) {
        const struct outcome outcome = compare((enum lib_case)which);

        if (!harness_equal(lib_golden[which].portable_name, outcome.differing, 0u)) {
            harness_note("first differing vector", outcome.first_index);
        }
#if LIB_TRIG_FRAC == 15
        (void)harness_equal(lib_golden[which].checksum_name, outcome.checksum, lib_golden[which].checksum);
#endif
    }
    harness_end();
}
