/* SPDX-License-Identifier: MIT */
#define LIB_PORTABLE

#include "tests/target/lib_inline.h"

struct lib_result lib_portable(uint32_t which, const int32_t in[4])
{
    return lib_inline(which, in);
}
