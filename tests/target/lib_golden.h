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
    [CASE_CLARKE] = LIB_GOLDEN("Clarke", 0x688929E8u),
    [CASE_INVCLARKE] = LIB_GOLDEN("InvClarke", 0xA5D57481u),
    [CASE_PARK] = LIB_GOLDEN("Park", 0x10D4E956u),
    [CASE_INVPARK] = LIB_GOLDEN("InvPark", 0x3A6541BDu),
    [CASE_SATURATIONS] = LIB_GOLDEN("saturations", 0x505E7F1Au),
    [CASE_CLARKE_Q15] = LIB_GOLDEN("Clarke Q15", 0xA678920Eu),
    [CASE_INVCLARKE_Q15] = LIB_GOLDEN("InvClarke Q15", 0xC2F0C0A3u),
    [CASE_PARK_Q15] = LIB_GOLDEN("Park Q15", 0x529E487Bu),
    [CASE_INVPARK_Q15] = LIB_GOLDEN("InvPark Q15", 0x1CF4F2E3u),
    [CASE_COSSIN] = LIB_GOLDEN("sine and cosine", 0xDF8F7014u),
    [CASE_PI] = LIB_GOLDEN("PI", 0x31DB7065u),
    [CASE_PI_HOLD] = LIB_GOLDEN("PI, hold", 0x0997456Cu),
    [CASE_PI_SATURATE] = LIB_GOLDEN("PI, saturate", 0x457FDCEEu),
    [CASE_CIRCLE] = LIB_GOLDEN("circle", 0x67BEFBF4u),
    [CASE_SVM] = LIB_GOLDEN("modulation", 0xED52CC53u),
    [CASE_SVM_MIDDLE] = LIB_GOLDEN("modulation, middle", 0x6E8E5441u),
    [CASE_DEADTIME] = LIB_GOLDEN("dead time", 0x8E9270B7u),
    [CASE_ADVANCE] = LIB_GOLDEN("advance", 0xCF4291CAu),
    [CASE_PLL] = LIB_GOLDEN("PLL", 0x4D67DB2Bu),
};

#endif
