/* SPDX-License-Identifier: MIT */
/* Arithmetic for the thread's part of identify. */
#include "firmware/commission/identify_parts.h"

#define ONE_Q30 (1LL << 30)

int32_t identify_within(int64_t value, int64_t most)
{
    return (int32_t)(value < 1 ? 1 : value < most ? value : most);
}

int64_t identify_scaled(int64_t a, int64_t b, int64_t c)
{
    const int64_t size = scale(identify_size(a), identify_size(b), c);
    return (a < 0) != (b < 0) ? -size : size;
}

int64_t identify_root(int64_t n)
{
    uint64_t root = 0;
    for (uint64_t bit = 1ULL << 31; bit != 0u; bit >>= 1) {
        const uint64_t next = root + bit;
        if (next * next <= (uint64_t)n) { /* next is below 2^32 */
            root = next;
        }
    }
    return (int64_t)root;
}

int64_t identify_interval(int64_t s, int64_t a, int64_t b)
{
    const int64_t sum = scale(identify_size(a), identify_size(a), 3) + scale(identify_size(b), identify_size(b), 3);
    return 2 * identify_root(scale(identify_size(s), identify_size(s), 1) + sum);
}

/* Student's t, two-sided 95 %, by degrees of freedom from 1 on, halved: in 256ths. */
static const uint16_t students_q8[] = {1626, 551, 407, 355, 329, 313, 303, 295, 290, 285, 282, 279, 277, 275, 273};

struct identify_spread identify_spread(const int64_t of[], int32_t count)
{
    int64_t sum = 0, squares = 0;
    for (int32_t k = 0; k < count; k++) {
        sum += of[k];
    }
    const int64_t mean = identify_scaled(sum, 1, count);
    for (int32_t k = 0; k < count; k++) {
        squares += (of[k] - mean) * (of[k] - mean);
    }
    const int64_t deviation = identify_root(scale(squares, 1, count * (count - 1)));
    return (struct identify_spread){mean, identify_scaled(deviation, students_q8[count - 2], 256)};
}

int64_t identify_log_q30(int64_t y_q30)
{
    const int64_t z_q30 = scale(y_q30, ONE_Q30, 2 * ONE_Q30 - y_q30);
    const int64_t square_q30 = (z_q30 * z_q30) >> 30;
    int64_t power_q30 = z_q30;
    int64_t sum_q30 = 0;
    for (int64_t n = 1; n < 1024 && power_q30 != 0; n += 2) {
        sum_q30 += scale(power_q30, 1, n);
        power_q30 = (power_q30 * square_q30) >> 30;
    }
    return 2 * sum_q30;
}
