/* SPDX-License-Identifier: MIT */
/* What is inline in the interrupt, for tests to call. */
#include "firmware/control/current_loop_step.h"

void host_flux_observe(struct current_loop *c, int32_t i_alpha, int32_t i_beta, int32_t v_alpha, int32_t v_beta);

void host_flux_observe(struct current_loop *c, int32_t i_alpha, int32_t i_beta, int32_t v_alpha, int32_t v_beta)
{
    flux_observe(c, (alphabeta_t){i_alpha, i_beta}, (alphabeta_t){v_alpha, v_beta});
}
