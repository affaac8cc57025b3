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
    ((struct lib_golden){name ": assembly is the C beside it", name ": as on the host", checksum})

static const struct lib_golden lib_golden[CASE_COUNT] = {
    [CASE_CLARKE] = LIB_GOLDEN("Clarke", 0x32421D6Fu),
    [CASE_INVCLARKE] = LIB_GOLDEN("InvClarke", 0x298DCA6Fu),
    [CASE_PARK] = LIB_GOLDEN("Park", 0x4B8B7179u),
    [CASE_INVPARK] = LIB_GOLDEN("InvPark", 0x1D174201u),
    [CASE_SATURATIONS] = LIB_GOLDEN("saturations", 0x4ED37F46u),
    [CASE_CLARKE_Q15] = LIB_GOLDEN("Clarke Q15", 0x021437F2u),
    [CASE_INVCLARKE_Q15] = LIB_GOLDEN("InvClarke Q15", 0x09FED34Au),
    [CASE_PARK_Q15] = LIB_GOLDEN("Park Q15", 0x3A72F95Cu),
    [CASE_INVPARK_Q15] = LIB_GOLDEN("InvPark Q15", 0x6E4694A4u),
    [CASE_COSSIN] = LIB_GOLDEN("sine and cosine", 0x63572282u),
    [CASE_PI] = LIB_GOLDEN("PI", 0x3016C406u),
    [CASE_PI_HOLD] = LIB_GOLDEN("PI, hold", 0x68D9315Fu),
    [CASE_PI_SATURATE] = LIB_GOLDEN("PI, saturate", 0x08232FB4u),
    [CASE_CIRCLE] = LIB_GOLDEN("circle", 0x4ECC9E6Du),
    [CASE_SVM] = LIB_GOLDEN("modulation", 0xD098FD20u),
    [CASE_SVM_MIDDLE] = LIB_GOLDEN("modulation, middle", 0x5C1B14A4u),
    [CASE_DEADTIME] = LIB_GOLDEN("dead time", 0x68086828u),
    [CASE_ADVANCE] = LIB_GOLDEN("advance", 0xC9B14489u),
    [CASE_PLL] = LIB_GOLDEN("PLL", 0xB53769F7u),
};

#endif
