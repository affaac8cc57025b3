/* SPDX-License-Identifier: MIT */
#undef LIB_TRIG_FRAC
#define LIB_TRIG_FRAC 16
#include "tests/target/lib_frac.inc"
