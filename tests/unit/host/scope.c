/* SPDX-License-Identifier: MIT */
/* What is inline in the sampler, for tests to call. */
#include "firmware/scope/scope.h"

void host_capture_take(struct capture *c, const int32_t *values, int32_t watched, bool fault);

/* As the sampler does it: into the slot, then it counts. */
void host_capture_take(struct capture *c, const int32_t *values, int32_t watched, bool fault)
{
    if (c->state != CAPTURE_WAITING && c->state != CAPTURE_TRIGGERED) {
        return;
    }
    int32_t *const slot = capture_slot(c);
    for (uint32_t i = 0; i < c->words; i++) {
        slot[i] = values[i];
    }
    capture_commit(c, watched, fault);
}
