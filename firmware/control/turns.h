/* SPDX-License-Identifier: MIT */
/*
 * The shaft's position over many turns: counts of the encoder since its zero, from a counter that begins anew each turn.
 * Followed whether the bridge is on or off, so nothing is lost in between. Once a millisecond, in the slow loop.
 *
 * A turn that the counter has gone round is told by inertia: from one millisecond to the next the way changes by less than
 * half a turn, whatever the speed. Range: below a turn and a half a millisecond.
 */
#ifndef FIRMWARE_CONTROL_TURNS_H
#define FIRMWARE_CONTROL_TURNS_H

#include <stdint.h>

struct turns {
    int64_t counts; /* since the zero: 292 million years at full speed of the finest encoder */
    uint32_t count; /* of the encoder, at the last step: 0 ... counts of a turn less one */
    int32_t moved;  /* in the last step */
};

/* The encoder shows `count` now, and that is position 0. Slow loop, or while it is masked. */
static inline void turns_begin(struct turns *t, uint32_t count)
{
    *t = (struct turns){.count = count};
}

/* One step: the encoder shows `count` of `turn` counts. Slow loop, 20 cycles. */
void turns_follow(struct turns *t, uint32_t count, int32_t turn);

/* The position at which the counter showed `count`, the one that is less than half a turn from here. Any context. */
int64_t turns_at(const struct turns *t, uint32_t count, int32_t turn);

#endif
