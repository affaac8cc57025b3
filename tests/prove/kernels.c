/* SPDX-License-Identifier: MIT */
/* Each Q15 kernel alone in a function, its operands in registers (the fifth on the stack): read by make prove, never linked. */
#include "lib/clarke3.h"
#include "lib/modulation.h"
#include "lib/pi.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

void prove_clarke(alphabeta_t *out, int32_t a, int32_t b);
void prove_clarke3(alphabeta_t *out, int32_t a, int32_t b, int32_t c);
void prove_clarke_bc(alphabeta_t *out, int32_t b, int32_t c);
void prove_clarke_ca(alphabeta_t *out, int32_t c, int32_t a);
void prove_invclarke(abc_t *out, int32_t alpha, int32_t beta);
void prove_park(dq_t *out, int32_t alpha, int32_t beta, int32_t cosine, int32_t sine);
void prove_invpark(alphabeta_t *out, int32_t d, int32_t q, int32_t cosine, int32_t sine);
void prove_cossin(cossin_t *out, uint32_t angle_q32);

struct prove_limited {
    int32_t output;
    int32_t step;
};

int32_t prove_pi_step(struct pi_q15 *pi, int32_t error, int32_t limit);
int32_t prove_pi_hold(int32_t step, int32_t unlimited, int32_t output);
void prove_pi_saturate(struct prove_limited *limited, int32_t limit);
int32_t prove_svm_middle(int32_t a, int32_t b);

void prove_clarke(alphabeta_t *out, int32_t a, int32_t b)
{
    *out = clarke_q15(a, b);
}

void prove_clarke3(alphabeta_t *out, int32_t a, int32_t b, int32_t c)
{
    *out = clarke3_q15((abc_t){a, b, c});
}

void prove_clarke_bc(alphabeta_t *out, int32_t b, int32_t c)
{
    *out = clarke_bc_q15(b, c);
}

void prove_clarke_ca(alphabeta_t *out, int32_t c, int32_t a)
{
    *out = clarke_ca_q15(c, a);
}

void prove_invclarke(abc_t *out, int32_t alpha, int32_t beta)
{
    *out = invclarke_q15((alphabeta_t){alpha, beta});
}

void prove_park(dq_t *out, int32_t alpha, int32_t beta, int32_t cosine, int32_t sine)
{
    *out = park_q15((alphabeta_t){alpha, beta}, (cossin_t){cosine, sine});
}

void prove_invpark(alphabeta_t *out, int32_t d, int32_t q, int32_t cosine, int32_t sine)
{
    *out = invpark_q15((dq_t){d, q}, (cossin_t){cosine, sine});
}

void prove_cossin(cossin_t *out, uint32_t angle_q32)
{
    *out = cossin_q15(angle_q32);
}

int32_t prove_pi_step(struct pi_q15 *pi, int32_t error, int32_t limit)
{
    return pi_q15_step(pi, error, limit);
}

int32_t prove_pi_hold(int32_t step, int32_t unlimited, int32_t output)
{
    return pi_q15_hold(step, unlimited, output);
}

void prove_pi_saturate(struct prove_limited *limited, int32_t limit)
{
    pi_q15_saturate(&limited->output, &limited->step, limit);
}

int32_t prove_svm_middle(int32_t a, int32_t b)
{
    return svm_middle(a, b, a + b);
}
