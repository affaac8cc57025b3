/* SPDX-License-Identifier: MIT */
/* The checksums of tests/target/lib_cases.h as the host computes them, one a line, in the order of enum lib_case. */
#include <stdio.h>

#include "tests/target/lib_cases.h"

int main(void)
{
    for (uint32_t which = 0; which < CASE_COUNT; which++) {
        uint32_t state = 1U + which;
        uint32_t checksum = 0;

        for (uint32_t index = 0; index < LIB_CASE_VECTORS; index++) {
            const struct lib_vector vector = lib_case_vector(index, &state);
            const struct lib_result result = lib_case_run((enum lib_case)which, &vector);

            checksum = lib_case_checksum(checksum, &result);
        }
        printf("%08lX\n", (unsigned long)checksum);
    }
    return 0;
}
