/* SPDX-License-Identifier: MIT */
/* What is inline in the interrupt, for tests to call. */
#include "firmware/control/current_loop_step.h"

void host_hall_observe(struct current_loop *c, struct hall *h, const struct encoder_regs *e);
void host_hall_samples(struct current_loop *c, struct hall *h, struct encoder_regs *e, const uint32_t *hall,
                       const uint32_t *clock, uint32_t loop_counts, uint32_t samples, uint32_t *angle_q32);

void host_hall_observe(struct current_loop *c, struct hall *h, const struct encoder_regs *e)
{
    hall_observe(c, h, e);
}

/* A run of samples, states and times of their last edges given; the angle that was predicted for each comes back. */
void host_hall_samples(struct current_loop *c, struct hall *h, struct encoder_regs *e, const uint32_t *hall,
                       const uint32_t *clock, uint32_t loop_counts, uint32_t samples, uint32_t *angle_q32)
{
    for (uint32_t n = 0; n < samples; n++) {
        angle_q32[n] = c->pll.angle_q32;
        *(volatile uint32_t *)(uintptr_t)&e->HALL = hall[n];
        *(volatile uint32_t *)(uintptr_t)&e->HALL_TIME = clock[n];
        *(volatile uint32_t *)(uintptr_t)&e->LATCH_TIME += loop_counts;
        hall_observe(c, h, e);
    }
}
