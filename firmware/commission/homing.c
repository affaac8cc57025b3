/* SPDX-License-Identifier: MIT */
#include "firmware/commission/homing.h"

#define BLOCKED_MS 100u /* a block */
#define STUCK_MS   500u /* no index will come */

void homing_begin(struct homing *h, enum homing_method method, const struct turns *turns)
{
    *h = (struct homing){.method = (uint32_t)method, .from = turns->counts, .counted = turns->counts};
}

static int64_t homing_size(int64_t x)
{
    return x < 0 ? -x : x;
}

/* One count forward and back, from a yielding shaft, is no motion. */
static void watch_motion(struct homing *h, const struct homing_view *v)
{
    if (!v->at_limit || homing_size(v->turns->counts - h->counted) > 1) {
        h->counted = v->turns->counts;
        h->blocked_ms = 0;
    } else {
        h->blocked_ms++;
    }
}

enum homing_result homing_step(struct homing *h, const struct homing_view *v)
{
    watch_motion(h, v);
    if (h->method == HOMING_INDEX && v->index_seen) {
        h->zero = turns_at(v->turns, v->index, v->turn);
        return HOMING_FOUND;
    }
    if (h->method == HOMING_BLOCK && h->blocked_ms >= BLOCKED_MS) {
        h->zero = v->turns->counts;
        return HOMING_FOUND;
    }
    const bool too_far = homing_size(v->turns->counts - h->from) > v->farthest;
    return too_far || h->blocked_ms >= STUCK_MS ? HOMING_FAILED : HOMING_SEARCHES;
}
