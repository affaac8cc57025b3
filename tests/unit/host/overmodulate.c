/* SPDX-License-Identifier: MIT */
/* What is inline in the interrupt, for tests to call. */
#include "firmware/control/current_loop_step.h"

dq_t host_overmodulate_longer(int32_t d, int32_t q);
uint32_t host_overmodulate_phase(int32_t half_on, int32_t share_q7);

const int32_t host_overmodulation_from = OVERMODULATION_FROM, host_overmodulation_squares = OVERMODULATION_SQUARES;
const int32_t host_six_steps = CONFIG_SIX_STEPS, host_half_counts = CONFIG_HALF_COUNTS;
const int32_t host_overmodulate_edge = OVERMODULATE_EDGE;
const uint16_t *const host_overmodulation_gain_q12 = overmodulation_gain_q12;

dq_t host_overmodulate_longer(int32_t d, int32_t q)
{
    return overmodulate_longer((dq_t){d, q});
}

uint32_t host_overmodulate_phase(int32_t half_on, int32_t share_q7)
{
    return overmodulate_phase(half_on, share_q7);
}
