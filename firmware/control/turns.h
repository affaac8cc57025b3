/* SPDX-License-Identifier: MIT */
/*
 * The shaft's position over many turns: counts of the encoder since its zero, from a counter that wraps each turn. Tracked with
 * the bridge on or off, so nothing is lost in between. Once a millisecond, in the slow loop.
 */
#ifndef FIRMWARE_CONTROL_TURNS_H
#define FIRMWARE_CONTROL_TURNS_H

#include <stdint.h>

struct turns {
    int64_t counts; /* since the zero: 292 million years at full speed of the finest encoder */
    uint32_t count; /* of the encoder, at the last step: 0 ... counts of a turn less one */
};

/* Sets position 0 at the encoder's present `count`. Slow loop, or while it is masked. */
static inline void turns_begin(struct turns *t, uint32_t count)
{
    *t = (struct turns){.count = count};
}

/* One step: the shaft moved by `moved` counts (speed_estimate.h), and the encoder shows `count`. Slow loop. */
static inline void turns_follow(struct turns *t, int32_t moved, uint32_t count)
{
    t->count = count;
    t->counts += moved;
}

/* The position nearest to `near` whose lower 32 bits are `counts`: hosts show and send no more of them. Any context. */
static inline int64_t turns_nearest(int64_t near, int32_t counts)
{
    return near + (int32_t)((uint32_t)counts - (uint32_t)near);
}

/* The position with counter value `count` that is less than half a turn from here. Any context. */
int64_t turns_at(const struct turns *t, uint32_t count, int32_t turn);

#endif
