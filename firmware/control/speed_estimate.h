/* SPDX-License-Identifier: MIT */
/*
 * The speed loop's speed: from the encoder's edges and their times, as good with 100 lines at 1 rpm as with 10 000 at full
 * speed. Once a millisecond, in the slow loop. The current loop keeps its own observer (lib/pll.h) for the angle.
 *
 * The travel from the last edge before one reading to the last before the next, over the difference of their times, is the mean
 * speed of that interval, without the one-count error of a fixed interval (the M/T method: Ohmae et al., "A
 * microprocessor-controlled high-accuracy wide-range speed regulator for motor drives", IEEE Trans. Ind. Electron. 29(3),
 * 1982). While no edge comes, the shaft turns by less than a count, which bounds the speed.
 *
 * Edges of A and B are not exactly a quarter line apart. Each edge's position is learned from how early or late it comes
 * against the speed so far: what one edge gains, the other loses, so the four cannot drift.
 *
 * An edge is the boundary of two counts in either direction: a shaft that swings across one has not moved.
 */
#ifndef FIRMWARE_CONTROL_SPEED_ESTIMATE_H
#define FIRMWARE_CONTROL_SPEED_ESTIMATE_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/encoder.h"
#include "firmware/settings/tuning.h"

#define SPEED_ESTIMATE_CLOCKS_LOST (1u << 28) /* 2.7 s without an edge: at rest, long before the clock wraps */

struct speed_estimate {
    int32_t speed_rpm_q15;
    int32_t travel_q15;       /* turned since the last step, rpm times milliseconds */
    uint32_t interval_clocks; /* between the edges used for the speed, or since the last one if longer */
    /* the last reading */
    int32_t moved;        /* counts since the one before, */
    uint32_t step_clocks; /* clocks since then, */
    uint32_t latch_clock; /* and its time: the encoder's clock at the sample */
    /* the last edge */
    uint32_t count;
    int32_t backwards; /* 1: crossed downwards, so it is the upper end of the count */
    uint32_t clock;
    int32_t beyond_q15;         /* estimated travel since then, rpm times milliseconds */
    bool lost;                  /* too long ago to be useful */
    int32_t edge_offset_q16[4]; /* offsets of a line's four edges from their nominal places, in counts */
};

/* The counter was set: forgets the edges. Slow loop, or while it is masked. */
void speed_estimate_reset(struct speed_estimate *e);

/* Takes over from another source with its speed: from the last edge on, edges measure it. Slow loop. */
void speed_estimate_resume(struct speed_estimate *e, const struct encoder_regs *encoder);

/* One step. Range: below 32767 rpm and a quarter of a turn a millisecond of change. Slow loop. */
void speed_estimate_step(struct speed_estimate *e, const struct encoder_regs *encoder, const struct tuning *t);

/* Takes another source's speed, travel in this millisecond and measuring time. Discards the edges. Slow loop. */
void speed_estimate_take(struct speed_estimate *e, int32_t speed_rpm_q15, int32_t travel_q15, uint32_t clocks);

#endif
