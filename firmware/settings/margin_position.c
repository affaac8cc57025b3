/* SPDX-License-Identifier: MIT */
#include "firmware/settings/margin_position.h"

#include "firmware/settings/margins.h"
#include "firmware/settings/mtpa.h"
#include "lib/polar.h"
#include "lib/trig.h"

#define TURN_U16    65536
#define QUARTER_U16 (TURN_U16 / 4)
#define MARGIN_U16  (TURN_U16 * MARGIN_POSITION_DEG / 360)
#define X_MOST_Q12  8192 /* twice the speed loop's bandwidth: beyond any crossover */

/* 1 + 1 / L at a frequency of x times the speed loop's bandwidth: Q15. */
struct number {
    int64_t real, imaginary;
};

static struct number beyond_one(int32_t x_q12, const struct params *p)
{
    const int64_t x2_q24 = (int64_t)x_q12 * x_q12;
    const int64_t n2_q24 = 16 * x2_q24 * x2_q24 / (16 * x2_q24 + (1 << 24)); /* (4 x^2)^2 / (16 x^2 + 1) */
    const int64_t n_q15 = mtpa_root(n2_q24 << 6);
    const uint32_t lag_u16 = (uint32_t)(QUARTER_U16 + margin_lag_u16(x_q12, p));
    const cossin_t c = cossin_q15(lag_u16 << 16);
    return (struct number){32768 + ((n_q15 * c.cos) >> 15), (n_q15 * c.sin) >> 15};
}

/* Where x |1 + 1 / L| reaches the position loop's bandwidth over the speed loop's, from below. */
static int32_t crossover_q12(int32_t position_bw_hz, const struct params *p)
{
    int32_t below = 0;
    int32_t above = X_MOST_Q12;
    while (above - below > 1) {
        const int32_t middle = (below + above) / 2;
        const struct number d = beyond_one(middle, p);
        const int64_t size_q15 = mtpa_root(d.real * d.real + d.imaginary * d.imaginary);
        if (size_q15 * middle * p->speed_bw_hz < (int64_t)position_bw_hz << 27) {
            below = middle;
        } else {
            above = middle;
        }
    }
    return above;
}

int32_t margin_of_position_u16(int32_t position_bw_hz, const struct params *p)
{
    const struct number d = beyond_one(crossover_q12(position_bw_hz, p), p);
    return QUARTER_U16 - ((int32_t)atan2_q32((int32_t)d.imaginary, (int32_t)d.real) >> 16);
}

int32_t margin_position_bw_hz(const struct params *p)
{
    int32_t works = 0;
    int32_t fails = p->speed_bw_hz;
    while (fails - works > 1) {
        const int32_t middle = (works + fails) / 2;
        if (margin_of_position_u16(middle, p) >= MARGIN_U16) {
            works = middle;
        } else {
            fails = middle;
        }
    }
    return works;
}
