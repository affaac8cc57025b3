/* SPDX-License-Identifier: MIT */
/* Checksums of the library's results over lib_cases.h, LIB_TRIG_FRAC 15; tests/lib/test_golden.py keeps them true. */
#ifndef TESTS_TARGET_LIB_GOLDEN_H
#define TESTS_TARGET_LIB_GOLDEN_H

#include "tests/target/lib_cases.h"

struct lib_golden {
    const char *portable_name;
    const char *checksum_name;
    uint32_t checksum;
};

#define LIB_GOLDEN(name, checksum) \
    { \
        name ": assembly is the C beside it", name ": as on the host", checksum \
    }

static const struct lib_golden lib_golden[CASE_COUNT] = {
    [CASE_CLARKE] = LIB_GOLDEN("Clarke", 0xC2BC5A67u),
    [CASE_INVCLARKE] = LIB_GOLDEN("InvClarke", 0x417861F0u),
    [CASE_PARK] = LIB_GOLDEN("Park", 0xA5B069DDu),
    [CASE_INVPARK] = LIB_GOLDEN("InvPark", 0x3DAAEF9Au),
    [CASE_SATURATIONS] = LIB_GOLDEN("saturations", 0xD1C6E6F7u),
    [CASE_CLARKE_Q15] = LIB_GOLDEN("Clarke Q15", 0xCE5C04D1u),
    [CASE_INVCLARKE_Q15] = LIB_GOLDEN("InvClarke Q15", 0x8096DE0Eu),
    [CASE_PARK_Q15] = LIB_GOLDEN("Park Q15", 0x021BD96Cu),
    [CASE_INVPARK_Q15] = LIB_GOLDEN("InvPark Q15", 0x3E7BACD5u),
    [CASE_COSSIN] = LIB_GOLDEN("sine and cosine", 0xAC023227u),
    [CASE_PI] = LIB_GOLDEN("PI", 0x5368A218u),
    [CASE_PI_HOLD] = LIB_GOLDEN("PI, hold", 0x02B72C95u),
    [CASE_PI_SATURATE] = LIB_GOLDEN("PI, saturate", 0x30BB5271u),
    [CASE_CIRCLE] = LIB_GOLDEN("circle", 0x5F32F59Eu),
    [CASE_SVM] = LIB_GOLDEN("modulation", 0xCCC2D09Fu),
    [CASE_SVM_MIDDLE] = LIB_GOLDEN("modulation, middle", 0x2E09C348u),
    [CASE_DEADTIME] = LIB_GOLDEN("dead time", 0x10958BBFu),
    [CASE_ADVANCE] = LIB_GOLDEN("advance", 0x3F8A270Cu),
    [CASE_PLL] = LIB_GOLDEN("PLL", 0x84E7750Au),
};

#endif
