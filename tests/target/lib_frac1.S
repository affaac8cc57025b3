/* SPDX-License-Identifier: MIT */
#undef LIB_TRIG_FRAC
#define LIB_TRIG_FRAC 1
#include "tests/target/lib_frac.inc"
