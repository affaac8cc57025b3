/* SPDX-License-Identifier: MIT */
#include "firmware/axis/axis.h"

uint64_t axis_up_ms(const struct axis *a)
{
    uint32_t wraps;
    uint32_t ms;
    do {
        wraps = a->time_wraps;
        ms = a->time_ms;
    } while (wraps != a->time_wraps);
    return ((uint64_t)wraps << 32) | ms;
}
