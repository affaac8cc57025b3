/* SPDX-License-Identifier: MIT */
#include "firmware/control/turns.h"

/* Into -turn / 2 ... turn / 2, from less than two turns outside of it. */
static int32_t wrapped(int32_t counts, int32_t turn)
{
    while (counts > turn >> 1) {
        counts -= turn;
    }
    while (counts < -(turn >> 1)) {
        counts += turn;
    }
    return counts;
}

int64_t turns_at(const struct turns *t, uint32_t count, int32_t turn)
{
    return t->counts + wrapped((int32_t)(count - t->count), turn);
}
