/* SPDX-License-Identifier: MIT */
/* The functions around the inline kernels. Included once by each build; KERNEL(name) puts the build's prefix before it. */
#include "lib/advance.h"
#include "lib/clarke3.h"
#include "lib/deadtime.h"
#include "lib/limit.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/pll.h"
#include "lib/polar.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"
#include "tests/bench/kernels.h"

/* Constants as in the current loop, where the compiler sees them. */
#define BENCH_FRACTION 13u

void KERNEL(clarke_q15)(const int32_t *in, int32_t *out)
{
    const alphabeta_t i = clarke_q15(in[0], in[1]);
    out[0] = i.alpha;
    out[1] = i.beta;
}

void KERNEL(invclarke_q15)(const int32_t *in, int32_t *out)
{
    const abc_t v = invclarke_q15((alphabeta_t){in[0], in[1]});
    out[0] = v.a;
    out[1] = v.b;
    out[2] = v.c;
}

void KERNEL(park_q15)(const int32_t *in, int32_t *out)
{
    const dq_t i = park_q15((alphabeta_t){in[0], in[1]}, (cossin_t){in[2], in[3]});
    out[0] = i.d;
    out[1] = i.q;
}

void KERNEL(invpark_q15)(const int32_t *in, int32_t *out)
{
    const alphabeta_t v = invpark_q15((dq_t){in[0], in[1]}, (cossin_t){in[2], in[3]});
    out[0] = v.alpha;
    out[1] = v.beta;
}

void KERNEL(cossin_q15)(const int32_t *in, int32_t *out)
{
    const cossin_t angle = cossin_q15((uint32_t)in[0]);
    out[0] = angle.cos;
    out[1] = angle.sin;
}

void KERNEL(clarke3_q15)(const int32_t *in, int32_t *out)
{
    const alphabeta_t i = clarke3_q15((abc_t){in[0], in[1], in[2]});
    out[0] = i.alpha;
    out[1] = i.beta;
}

void KERNEL(clarke_bc_q15)(const int32_t *in, int32_t *out)
{
    const alphabeta_t i = clarke_bc_q15(in[0], in[1]);
    out[0] = i.alpha;
    out[1] = i.beta;
}

void KERNEL(clarke_ca_q15)(const int32_t *in, int32_t *out)
{
    const alphabeta_t i = clarke_ca_q15(in[0], in[1]);
    out[0] = i.alpha;
    out[1] = i.beta;
}

void KERNEL(atan2_q15)(const int32_t *in, int32_t *out)
{
    out[0] = (int32_t)atan2_q15(in[0], in[1]);
}

void KERNEL(magnitude_q15)(const int32_t *in, int32_t *out)
{
    out[0] = magnitude_q15(in[0], in[1]);
}

void KERNEL(pi_q15_step)(const int32_t *in, int32_t *out)
{
    struct pi_q15 pi = {in[0], in[1], in[2]};
    out[0] = pi_q15_step(&pi, in[3], in[4]);
    out[1] = pi.integral_q9;
}

void KERNEL(circle_rest_q15)(const int32_t *in, int32_t *out)
{
    out[0] = circle_rest_q15(in[0], in[1]);
}

void KERNEL(svm_minmax)(const int32_t *in, int32_t *out)
{
    const abc_t v = svm_minmax((abc_t){.a = in[0], .b = in[1]});
    out[0] = v.a;
    out[1] = v.b;
    out[2] = v.c;
}

void KERNEL(deadtime_share_q7)(const int32_t *in, int32_t *out)
{
    out[0] = deadtime_share_q7(in[0], BENCH_FRACTION);
}

void KERNEL(advance_q15)(const int32_t *in, int32_t *out)
{
    int32_t x = in[0], y = in[1];
    advance_q15(&x, &y, in[2]);
    out[0] = x;
    out[1] = y;
}

void KERNEL(pll_step)(const int32_t *in, int32_t *out)
{
    struct pll pll = {(uint32_t)in[0], in[1]};
    pll_step(&pll, (uint32_t)in[2]);
    out[0] = (int32_t)pll.angle_q32;
    out[1] = pll.speed_q32;
}
