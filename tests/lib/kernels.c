/* SPDX-License-Identifier: MIT */
/* Each kernel of the hot path alone in a function, compiled for the target and read by test_codegen.py. Never linked. */
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

#define KERNEL(name, result, parameters, expression) \
    void kernel_##name(result *out, parameters); \
    void kernel_##name(result *out, parameters) \
    { \
        *out = expression; \
    }
#define TWO(x, y)      x, y
#define THREE(x, y, z) x, y, z

KERNEL(clarke, alphabeta_t, TWO(int32_t a, int32_t b), clarke_q15(a, b))
KERNEL(park, dq_t, TWO(const alphabeta_t *i, const cossin_t *angle), park_q15(*i, *angle))
KERNEL(invpark, alphabeta_t, TWO(const dq_t *v, const cossin_t *angle), invpark_q15(*v, *angle))
KERNEL(invclarke, abc_t, const alphabeta_t *v, invclarke_q15(*v))
KERNEL(cossin, cossin_t, uint32_t angle_q32, cossin_q15(angle_q32))
KERNEL(clarke3, alphabeta_t, const abc_t *i, clarke3_q15(*i))
KERNEL(clarke_bc, alphabeta_t, TWO(int32_t b, int32_t c), clarke_bc_q15(b, c))
KERNEL(clarke_ca, alphabeta_t, TWO(int32_t c, int32_t a), clarke_ca_q15(c, a))
KERNEL(atan2, uint32_t, TWO(int32_t y, int32_t x), atan2_q15(y, x))
KERNEL(magnitude, int32_t, TWO(int32_t x, int32_t y), magnitude_q15(x, y))
KERNEL(pi, int32_t, THREE(struct pi_q15 *pi, int32_t error, int32_t limit), pi_q15_step(pi, error, limit))
KERNEL(pi_hold, int32_t, THREE(int32_t step, int32_t unlimited, int32_t output), pi_q15_hold(step, unlimited, output))
KERNEL(circle_rest, int32_t, TWO(int32_t d, int32_t radius), circle_rest_q15(d, radius))
KERNEL(svm, abc_t, const abc_t *v, svm_minmax(*v))
KERNEL(deadtime, int32_t, int32_t current, deadtime_share_q7(current, 13U))

void kernel_advance(int32_t *x, int32_t *y, int32_t turn);
void kernel_advance(int32_t *x, int32_t *y, int32_t turn)
{
    advance_q15(x, y, turn);
}

void kernel_pll(struct pll *pll, uint32_t measured);
void kernel_pll(struct pll *pll, uint32_t measured)
{
    pll_step(pll, measured);
}
