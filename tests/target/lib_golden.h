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
    [CASE_CLARKE] = LIB_GOLDEN("Clarke", 0xF5AD2A09u),
    [CASE_INVCLARKE] = LIB_GOLDEN("InvClarke", 0x04BBFADAu),
    [CASE_PARK] = LIB_GOLDEN("Park", 0x28D74A23u),
    [CASE_INVPARK] = LIB_GOLDEN("InvPark", 0x0127D43Au),
    [CASE_SATURATIONS] = LIB_GOLDEN("saturations", 0xC1E827A7u),
    [CASE_CLARKE_Q15] = LIB_GOLDEN("Clarke Q15", 0x40223FC8u),
    [CASE_INVCLARKE_Q15] = LIB_GOLDEN("InvClarke Q15", 0x07B448D1u),
    [CASE_PARK_Q15] = LIB_GOLDEN("Park Q15", 0x12853F33u),
    [CASE_INVPARK_Q15] = LIB_GOLDEN("InvPark Q15", 0x8327166Fu),
    [CASE_COSSIN] = LIB_GOLDEN("sine and cosine", 0x0809C522u),
    [CASE_PI] = LIB_GOLDEN("PI", 0xA0CA0C85u),
    [CASE_CIRCLE] = LIB_GOLDEN("circle", 0x4D1E9CF9u),
    [CASE_SVM] = LIB_GOLDEN("modulation", 0x52F59602u),
    [CASE_RECIPROCAL] = LIB_GOLDEN("reciprocal", 0x88AF12B4u),
    [CASE_DEADTIME] = LIB_GOLDEN("dead time", 0x5AE6670Au),
    [CASE_PLL] = LIB_GOLDEN("PLL", 0x0D39B9B6u),
};

#endif
