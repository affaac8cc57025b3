/* SPDX-License-Identifier: MIT */
/* What is inline in the interrupt, for tests to call. */
#include "firmware/control/current_loop_step.h"

int32_t host_inject_voltage(struct current_loop *c);
int32_t host_inject_calm(struct current_loop *c, int32_t i_alpha, int32_t i_beta, int32_t axis);
void host_inject_observe(struct current_loop *c, int32_t i_alpha, int32_t i_beta, uint32_t angle_q32);
void host_inject_sample(struct current_loop *c, int32_t i_alpha, int32_t i_beta);

int32_t host_inject_voltage(struct current_loop *c)
{
    return inject_voltage(&c->inject);
}

/* Of what the controllers see, axis 0 alpha, 1 beta. */
int32_t host_inject_calm(struct current_loop *c, int32_t i_alpha, int32_t i_beta, int32_t axis)
{
    const alphabeta_t calm = inject_without_ripple(&c->inject, (alphabeta_t){i_alpha, i_beta});
    return axis == 0 ? calm.alpha : calm.beta;
}

void host_inject_observe(struct current_loop *c, int32_t i_alpha, int32_t i_beta, uint32_t angle_q32)
{
    inject_observe(c, (alphabeta_t){i_alpha, i_beta}, cossin_q15(angle_q32));
}

/* A sample of LOOP_INJECTION but for the PWM: the voltage is left where the flux observer keeps its own. */
void host_inject_sample(struct current_loop *c, int32_t i_alpha, int32_t i_beta)
{
    const alphabeta_t i = {i_alpha, i_beta};
    const cossin_t cs = cossin_q15(angle_observed(c));
    const int32_t inject_steps = inject_voltage(&c->inject);
    const dq_t v = regulate(c, park_q15(inject_without_ripple(&c->inject, i), cs), inject_steps);
    c->flux.v_alpha_steps = (v.d * cs.cos - v.q * cs.sin) >> 15;
    c->flux.v_beta_steps = (v.d * cs.sin + v.q * cs.cos) >> 15;
    inject_observe(c, i, cs);
}
