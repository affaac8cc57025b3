/* SPDX-License-Identifier: MIT */
#include "firmware/scope/capture.h"

void capture_begin(struct capture *c, int32_t last, bool fault)
{
    c->fire = false;
    c->cause = CAPTURE_BY_NOTHING;
    c->next = 0u;
    c->filled = 0u;
    c->left = 0u;
    c->had_before = 0u;
    c->last = last;
    c->had_fault = fault;
    c->state = CAPTURE_WAITING;
}

uint32_t capture_samples(const struct capture *c)
{
    return c->state == CAPTURE_DONE ? c->had_before + c->samples - c->before : 0u;
}

/* The newest stands right before `next`. */
int32_t capture_word(const struct capture *c, uint32_t sample, uint32_t word)
{
    const uint32_t back = capture_samples(c) - sample;
    const uint32_t place = c->next >= back ? c->next - back : c->next + c->samples - back;
    return c->memory[place * c->words + word];
}
