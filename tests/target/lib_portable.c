/* SPDX-License-Identifier: MIT */
/* The library once more, with the assembly switched off and its functions under other names, for test_lib.c. */
#define LIB_PORTABLE

#define Clarke_Lib_Do    portable_Clarke_Lib_Do
#define InvClarke_Lib_Do portable_InvClarke_Lib_Do
#define Park_Lib_Do      portable_Park_Lib_Do
#define InvPark_Lib_Do   portable_InvPark_Lib_Do

#include "lib/Lib.c" /* the source itself: that is the point */
#include "tests/target/lib_cases.h"

struct lib_result lib_case_portable(enum lib_case which, const struct lib_vector *v)
{
    return lib_case_run(which, v);
}
