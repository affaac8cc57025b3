/* SPDX-License-Identifier: MIT */
#include "firmware/settings/scale.h"

struct wide {
    uint64_t high, low;
};

static struct wide product(uint64_t a, uint64_t b)
{
    const uint64_t a_low = (uint32_t)a, a_high = a >> 32, b_low = (uint32_t)b, b_high = b >> 32;
    const uint64_t low = a_low * b_low;
    const uint64_t middle = a_high * b_low + (low >> 32); /* both below 2^63: the operands have 63 bits */
    const uint64_t other = a_low * b_high + (uint32_t)middle;
    return (struct wide){a_high * b_high + (middle >> 32) + (other >> 32), (other << 32) | (uint32_t)low};
}

int64_t scale(int64_t a, int64_t b, int64_t c)
{
    struct wide rest = product((uint64_t)a, (uint64_t)b);
    const uint64_t divisor = (uint64_t)c, half = divisor / 2u;
    rest.low += half;
    rest.high += rest.low < half;
    if (rest.high >= divisor) { /* the quotient would have more than 64 bits */
        return INT64_MAX;
    }
    uint64_t quotient = 0;
    for (int bit = 0; bit < 64; bit++) { /* long division; the remainder stays below the divisor */
        rest.high = (rest.high << 1) | (rest.low >> 63);
        rest.low <<= 1;
        quotient <<= 1;
        if (rest.high >= divisor) {
            rest.high -= divisor;
            quotient |= 1u;
        }
    }
    return quotient > INT64_MAX ? INT64_MAX : (int64_t)quotient;
}

int32_t tuning_q15_from_milli(int32_t milli, int32_t range_milli)
{
    const int64_t magnitude = scale(milli < 0 ? -(int64_t)milli : milli, 32768, range_milli);
    return (int32_t)(milli < 0 ? -magnitude : magnitude);
}

int32_t tuning_milli_from_q15(int32_t q15, int32_t range_milli)
{
    return (int32_t)(((int64_t)q15 * range_milli + 16384) >> 15);
}
