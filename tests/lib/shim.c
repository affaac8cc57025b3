/* SPDX-License-Identifier: MIT */
/*
 * The library as a shared object for the Python tests: each inline kernel behind a function over arrays, so that a test
 * can sweep a domain in one call. Lib.c is linked beside it.
 */
#include <stddef.h>

#include "lib/LibFoc.h"
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

void shim_clarke(size_t n, const int32_t *a, const int32_t *b, int32_t *alpha, int32_t *beta);
void shim_invclarke(size_t n, const int32_t *alpha, const int32_t *beta, int32_t *a, int32_t *b, int32_t *c);
void shim_park(size_t n, const int32_t *alpha, const int32_t *beta, const int32_t *cosine, const int32_t *sine,
               int32_t *d, int32_t *q);
void shim_invpark(size_t n, const int32_t *d, const int32_t *q, const int32_t *cosine, const int32_t *sine,
                  int32_t *alpha, int32_t *beta);
void shim_cossin(size_t n, const uint32_t *angle, int32_t *cosine, int32_t *sine);
void shim_clarke3(size_t n, const int32_t *a, const int32_t *b, const int32_t *c, int32_t *alpha, int32_t *beta);
void shim_clarke_bc(size_t n, const int32_t *b, const int32_t *c, int32_t *alpha, int32_t *beta);
void shim_clarke_ca(size_t n, const int32_t *c, const int32_t *a, int32_t *alpha, int32_t *beta);
void shim_atan2(size_t n, const int32_t *y, const int32_t *x, uint32_t *angle_q32, uint32_t *angle_u16);
void shim_magnitude(size_t n, const int32_t *x, const int32_t *y, int32_t *length);
void shim_polar_root(size_t n, const uint32_t *square, int32_t *root);
void shim_polar_reciprocal(size_t n, const uint32_t *normalized, uint32_t *reciprocal);
void shim_polar_arctangent(size_t n, const uint32_t *ratio, uint32_t *angle);
void shim_sincos(size_t n, const uint32_t *angle, int32_t *cosine, int32_t *sine);
void shim_polar_root_down(size_t n, const uint32_t *square, int32_t *root);
void shim_circle_rest(size_t n, const int32_t *d, const int32_t *radius, int32_t *rest);
void shim_svm(size_t n, const int32_t *a, const int32_t *b, const int32_t *c, int32_t *out_a, int32_t *out_b,
              int32_t *out_c);
void shim_svm_middle(size_t n, const int32_t *a, const int32_t *b, int32_t *middle);
void shim_deadtime(size_t n, const int32_t *current, const uint32_t *fraction, int32_t *share);
void shim_advance(size_t n, const int32_t *x, const int32_t *y, const int32_t *turn, int32_t *x_out, int32_t *y_out);
void shim_sat16(size_t n, const int32_t *x, int32_t *sat16);
void shim_pi(size_t n, struct pi_q15 *pi, const int32_t *error, const int32_t *limit, int32_t *output,
             int32_t *integral);
void shim_pi_hold(size_t n, const int32_t *step, const int32_t *unlimited, const int32_t *output, int32_t *held);
void shim_pi_saturate(size_t n, const int32_t *output, const int32_t *step, const int32_t *limit, int32_t *limited,
                      int32_t *held);
void shim_pll(size_t n, struct pll *pll, const uint32_t *measured, uint32_t *angle, int32_t *speed);
void shim_pll_reset(struct pll *pll, uint32_t angle);

void shim_clarke(size_t n, const int32_t *a, const int32_t *b, int32_t *alpha, int32_t *beta)
{
    for (size_t k = 0; k < n; k++) {
        const alphabeta_t out = clarke_q15(a[k], b[k]);

        alpha[k] = out.alpha;
        beta[k] = out.beta;
    }
}

void shim_invclarke(size_t n, const int32_t *alpha, const int32_t *beta, int32_t *a, int32_t *b, int32_t *c)
{
    for (size_t k = 0; k < n; k++) {
        const abc_t out = invclarke_q15((alphabeta_t){alpha[k], beta[k]});

        a[k] = out.a;
        b[k] = out.b;
        c[k] = out.c;
    }
}

void shim_park(size_t n, const int32_t *alpha, const int32_t *beta, const int32_t *cosine, const int32_t *sine,
               int32_t *d, int32_t *q)
{
    for (size_t k = 0; k < n; k++) {
        const dq_t out = park_q15((alphabeta_t){alpha[k], beta[k]}, (cossin_t){cosine[k], sine[k]});

        d[k] = out.d;
        q[k] = out.q;
    }
}

void shim_invpark(size_t n, const int32_t *d, const int32_t *q, const int32_t *cosine, const int32_t *sine,
                  int32_t *alpha, int32_t *beta)
{
    for (size_t k = 0; k < n; k++) {
        const alphabeta_t out = invpark_q15((dq_t){d[k], q[k]}, (cossin_t){cosine[k], sine[k]});

        alpha[k] = out.alpha;
        beta[k] = out.beta;
    }
}

void shim_cossin(size_t n, const uint32_t *angle, int32_t *cosine, int32_t *sine)
{
    for (size_t k = 0; k < n; k++) {
        const cossin_t out = cossin_q15(angle[k]);

        cosine[k] = out.cos;
        sine[k] = out.sin;
    }
}

void shim_clarke3(size_t n, const int32_t *a, const int32_t *b, const int32_t *c, int32_t *alpha, int32_t *beta)
{
    for (size_t k = 0; k < n; k++) {
        const alphabeta_t out = clarke3_q15((abc_t){a[k], b[k], c[k]});

        alpha[k] = out.alpha;
        beta[k] = out.beta;
    }
}

void shim_clarke_bc(size_t n, const int32_t *b, const int32_t *c, int32_t *alpha, int32_t *beta)
{
    for (size_t k = 0; k < n; k++) {
        const alphabeta_t out = clarke_bc_q15(b[k], c[k]);

        alpha[k] = out.alpha;
        beta[k] = out.beta;
    }
}

void shim_clarke_ca(size_t n, const int32_t *c, const int32_t *a, int32_t *alpha, int32_t *beta)
{
    for (size_t k = 0; k < n; k++) {
        const alphabeta_t out = clarke_ca_q15(c[k], a[k]);

        alpha[k] = out.alpha;
        beta[k] = out.beta;
    }
}

void shim_atan2(size_t n, const int32_t *y, const int32_t *x, uint32_t *angle_q32, uint32_t *angle_u16)
{
    for (size_t k = 0; k < n; k++) {
        angle_q32[k] = atan2_q32(y[k], x[k]);
        angle_u16[k] = atan2_q15(y[k], x[k]);
    }
}

void shim_magnitude(size_t n, const int32_t *x, const int32_t *y, int32_t *length)
{
    for (size_t k = 0; k < n; k++) {
        length[k] = magnitude_q15(x[k], y[k]);
    }
}

void shim_polar_root(size_t n, const uint32_t *square, int32_t *root)
{
    for (size_t k = 0; k < n; k++) {
        root[k] = polar_root(square[k]);
    }
}

void shim_polar_reciprocal(size_t n, const uint32_t *normalized, uint32_t *reciprocal)
{
    for (size_t k = 0; k < n; k++) {
        reciprocal[k] = polar_reciprocal_q16(normalized[k]);
    }
}

void shim_polar_arctangent(size_t n, const uint32_t *ratio, uint32_t *angle)
{
    for (size_t k = 0; k < n; k++) {
        angle[k] = polar_arctangent_q32(ratio[k]);
    }
}

void shim_sincos(size_t n, const uint32_t *angle, int32_t *cosine, int32_t *sine)
{
    for (size_t k = 0; k < n; k++) {
        sincosoutput_type out;

        SinCos_Lib_Do(angle[k], &out);
        cosine[k] = out.cos;
        sine[k] = out.sin;
    }
}

void shim_polar_root_down(size_t n, const uint32_t *square, int32_t *root)
{
    for (size_t k = 0; k < n; k++) {
        root[k] = polar_root_down(square[k]);
    }
}

void shim_circle_rest(size_t n, const int32_t *d, const int32_t *radius, int32_t *rest)
{
    for (size_t k = 0; k < n; k++) {
        rest[k] = circle_rest_q15(d[k], radius[k]);
    }
}

void shim_svm(size_t n, const int32_t *a, const int32_t *b, const int32_t *c, int32_t *out_a, int32_t *out_b,
              int32_t *out_c)
{
    for (size_t k = 0; k < n; k++) {
        const abc_t out = svm_minmax((abc_t){a[k], b[k], c[k]});

        out_a[k] = out.a;
        out_b[k] = out.b;
        out_c[k] = out.c;
    }
}

void shim_svm_middle(size_t n, const int32_t *a, const int32_t *b, int32_t *middle)
{
    for (size_t k = 0; k < n; k++) {
        middle[k] = svm_middle(a[k], b[k], a[k] + b[k]);
    }
}

void shim_deadtime(size_t n, const int32_t *current, const uint32_t *fraction, int32_t *share)
{
    for (size_t k = 0; k < n; k++) {
        share[k] = deadtime_share_q7(current[k], fraction[k]);
    }
}

void shim_advance(size_t n, const int32_t *x, const int32_t *y, const int32_t *turn, int32_t *x_out, int32_t *y_out)
{
    for (size_t k = 0; k < n; k++) {
        x_out[k] = x[k];
        y_out[k] = y[k];
        advance_q15(&x_out[k], &y_out[k], turn[k]);
    }
}

void shim_sat16(size_t n, const int32_t *x, int32_t *sat16)
{
    for (size_t k = 0; k < n; k++) {
        sat16[k] = q15_sat16(x[k]);
    }
}

void shim_pi(size_t n, struct pi_q15 *pi, const int32_t *error, const int32_t *limit, int32_t *output,
             int32_t *integral)
{
    for (size_t k = 0; k < n; k++) {
        output[k] = pi_q15_step(pi, error[k], limit[k]);
        integral[k] = pi->integral_q9;
    }
}

void shim_pi_hold(size_t n, const int32_t *step, const int32_t *unlimited, const int32_t *output, int32_t *held)
{
    for (size_t k = 0; k < n; k++) {
        held[k] = pi_q15_hold(step[k], unlimited[k], output[k]);
    }
}

void shim_pi_saturate(size_t n, const int32_t *output, const int32_t *step, const int32_t *limit, int32_t *limited,
                      int32_t *held)
{
    for (size_t k = 0; k < n; k++) {
        limited[k] = output[k];
        held[k] = step[k];
        pi_q15_saturate(&limited[k], &held[k], limit[k]);
    }
}

void shim_pll(size_t n, struct pll *pll, const uint32_t *measured, uint32_t *angle, int32_t *speed)
{
    for (size_t k = 0; k < n; k++) {
        pll_step(pll, measured[k]);
        angle[k] = pll->angle_q32;
        speed[k] = pll->speed_q32;
    }
}

void shim_pll_reset(struct pll *pll, uint32_t angle)
{
    pll_reset(pll, angle);
}
