/* SPDX-License-Identifier: MIT */
/* Each Q15 kernel alone in a function, its operands in registers (the fifth on the stack): read by make prove, never linked. */
#include "lib/clarke3.h"
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
