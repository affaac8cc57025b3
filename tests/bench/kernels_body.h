/* SPDX-License-Identifier: MIT */
/* The functions around the inline kernels. Included once by each build; KERNEL(name) puts the build's prefix before it. */
#include "firmware/config.h"
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
#define BENCH_KNEE_SHIFT 9u

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
    out[0] = pi_q15_step(&pi, in[3], in[4], in[5]);
    out[1] = pi.integral_q30;
}

void KERNEL(limit_root)(const int32_t *in, int32_t *out)
{
    out[0] = (int32_t)limit_root((uint32_t)in[0]);
}

void KERNEL(circle_rest_q15)(const int32_t *in, int32_t *out)
{
    out[0] = circle_rest_q15(in[0], in[1]);
}

void KERNEL(circle_limit_q15)(const int32_t *in, int32_t *out)
{
    const dq_t v = circle_limit_q15((dq_t){in[0], in[1]}, in[2]);
    out[0] = v.d;
    out[1] = v.q;
}

void KERNEL(svm_minmax_q15)(const int32_t *in, int32_t *out)
{
    const abc_t duty = svm_minmax_q15((abc_t){in[0], in[1], in[2]}, in[3]);
    out[0] = duty.a;
    out[1] = duty.b;
    out[2] = duty.c;
}

void KERNEL(recip_q14_refine)(const int32_t *in, int32_t *out)
{
    out[0] = recip_q14_refine(in[0], in[1]);
}

void KERNEL(deadtime_comp)(const int32_t *in, int32_t *out)
{
    out[0] = deadtime_comp(in[0], (int32_t)CONFIG_DEAD_COUNTS, BENCH_KNEE_SHIFT);
}

void KERNEL(pll_step)(const int32_t *in, int32_t *out)
{
    struct pll pll = {(uint32_t)in[0], in[1], in[2], in[3]};
    pll_step(&pll, (uint32_t)in[4]);
    out[0] = (int32_t)pll.angle_q32;
    out[1] = pll.speed_q32;
}

/* From two phase currents to three on-times: what is left of a current loop without registers, observer and protection. */
void KERNEL(foc_step_q15)(const int32_t *in, int32_t *out)
{
    static struct {
        struct pi_q15 d, q;
        int32_t radius_q15;
    } state = {{4096, 2000, 0}, {4096, 2000, 0}, 15000};
    const cossin_t angle = cossin_q15((uint32_t)in[2]);
    const dq_t i = park_q15(clarke_q15(in[0], in[1]), angle);
    dq_t v;

    v.d = pi_q15_step(&state.d, in[3] - i.d, 0, state.radius_q15);
    v.q = pi_q15_step(&state.q, in[4] - i.q, 0, circle_rest_q15(v.d, state.radius_q15));
    const abc_t duty = svm_minmax_q15(invclarke_q15(invpark_q15(v, angle)), in[5]);
    out[0] = duty.a;
    out[1] = duty.b;
    out[2] = duty.c;
}
