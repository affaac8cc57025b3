/* SPDX-License-Identifier: MIT */
#include "firmware/control/notch.h"

#define RADIUS_Q13        4915 /* 0.6 */
#define RADIUS_SQUARE_Q13 2949

void notch_reset(struct notch *n, int32_t demand)
{
    n->x[0] = n->x[1] = n->y[0] = n->y[1] = demand;
}

void notch_set(struct notch *n, int32_t c_q13, int32_t demand)
{
    n->on = true;
    n->c_q13 = c_q13;
    n->rc_q13 = (RADIUS_Q13 * c_q13) >> 13;
    n->gain_q13 = ((8192 - n->rc_q13 + RADIUS_SQUARE_Q13) << 13) / (16384 - c_q13);
    notch_reset(n, demand);
}

/* Rounded: a demand that rests is passed as it is, since what remains of an error fades with the poles. */
int32_t notch_step(struct notch *n, int32_t x)
{
    const int64_t zeros = (int64_t)x + n->x[1] - (((int64_t)n->c_q13 * n->x[0]) >> 13);
    const int64_t poles = (int64_t)n->rc_q13 * n->y[0] - (int64_t)RADIUS_SQUARE_Q13 * n->y[1];
    const int64_t y = (zeros * n->gain_q13 + poles + 4096) >> 13;
    const int32_t now = y > INT32_MAX ? INT32_MAX : (y < -INT32_MAX ? -INT32_MAX : (int32_t)y);
    n->x[1] = n->x[0];
    n->x[0] = x;
    n->y[1] = n->y[0];
    n->y[0] = now;
    return now;
}
