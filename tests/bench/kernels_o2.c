/* SPDX-License-Identifier: MIT */
/* The portable C of the whole library at -O2 (tests/bench/bench.mk sets it), under names of its own. */
#define LIB_PORTABLE
#define KERNEL(name) o2_##name

#define Clarke_Lib_Do    o2_Clarke_Lib_Do
#define InvClarke_Lib_Do o2_InvClarke_Lib_Do
#define Park_Lib_Do      o2_Park_Lib_Do
#define InvPark_Lib_Do   o2_InvPark_Lib_Do

#include "lib/Lib.c" /* the source itself: that is the point */

#undef Clarke_Lib_Do
#undef InvClarke_Lib_Do
#undef Park_Lib_Do
#undef InvPark_Lib_Do

#include "tests/bench/kernels_body.h"
