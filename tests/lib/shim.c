/* SPDX-License-Identifier: MIT */
/*
 * The library as a shared object for the Python tests: each kernel behind a function from words to words (the benchmark's, and
 * those below), and sweeps of one over many rows of words. Lib.c is linked beside it.
 */
#include <stddef.h>

#include "lib/LibFoc.h"
#include "lib/deadtime.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/pll.h"
#include "lib/polar.h"

#define WORDS(name, ...) \
    void shipped_##name(const int32_t *in, int32_t *out); \
    void shipped_##name(const int32_t *in, int32_t *out) \
    { \
        __VA_ARGS__ \
    }

WORDS(sat16, out[0] = q15_sat16(in[0]);)
WORDS(atan2, out[0] = (int32_t)atan2_q32(in[0], in[1]); out[1] = (int32_t)atan2_q15(in[0], in[1]);)
WORDS(polar_root, out[0] = polar_root((uint32_t)in[0]);)
WORDS(polar_root_down, out[0] = polar_root_down((uint32_t)in[0]);)
WORDS(polar_reciprocal, out[0] = (int32_t)polar_reciprocal_q16((uint32_t)in[0]);)
WORDS(polar_arctangent, out[0] = (int32_t)polar_arctangent_q32((uint32_t)in[0]);)
WORDS(sincos, sincosoutput_type angle; SinCos_Lib_Do((uint32_t)in[0], &angle); out[0] = angle.cos; out[1] = angle.sin;)
WORDS(svm, const abc_t v = svm_minmax((abc_t){in[0], in[1], in[2]}); out[0] = v.a; out[1] = v.b; out[2] = v.c;)
WORDS(svm_middle, out[0] = svm_middle(in[0], in[1], in[0] + in[1]);)
WORDS(deadtime, out[0] = deadtime_share_q7(in[0], (uint32_t)in[1]);)
WORDS(pi_hold, out[0] = pi_q15_hold(in[0], in[1], in[2]);)
WORDS(pi_saturate, out[0] = in[0]; out[1] = in[1]; pi_q15_saturate(&out[0], &out[1], in[2]);)

void shim_sweep(void (*kernel)(const int32_t *in, int32_t *out), size_t n, size_t reads, size_t writes,
                const int32_t *in, int32_t *out);
void shim_pi(size_t n, struct pi_q15 *pi, const int32_t *error, const int32_t *limit, int32_t *output,
             int32_t *integral);
void shim_pll(size_t n, struct pll *pll, const uint32_t *measured, uint32_t *angle, int32_t *speed);
void shim_pll_reset(struct pll *pll, uint32_t angle);

void shim_sweep(void (*kernel)(const int32_t *in, int32_t *out), size_t n, size_t reads, size_t writes,
                const int32_t *in, int32_t *out)
{
    for (size_t k = 0; k < n; k++) {
        kernel(in + k * reads, out + k * writes);
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
