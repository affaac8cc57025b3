/* SPDX-License-Identifier: MIT */
/*
 * The speed loop's speed: from the encoder's edges and when they came, as good with 100 lines at 1 rpm as with 10 000 at
 * full speed. Once a millisecond, in the slow loop. The current loop keeps its own observer (lib/pll.h) for the angle.
 *
 * Between two readings the shaft has turned from the last edge of the one to the last edge of the other, in exactly the
 * difference of their times: the mean speed of that interval, without the count of error that an interval fixed in time has
 * (the M/T method: Ohmae et al., "A microprocessor-controlled high-accuracy wide-range speed regulator for motor drives",
 * IEEE Trans. Ind. Electron. 29(3), 1982). While no edge comes the shaft turns by less than a count, which bounds the speed.
 *
 * Edges of A and B are not a quarter of a line apart. Where each of the four stands is learned from how much too early or
 * too late it comes, against the speed so far: what one edge gains, the other loses, so that the four cannot run away.
 *
 * An edge is where two counts meet, whichever way it is crossed: a shaft that swings over one has not moved.
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
    uint32_t interval_clocks; /* between the edges that the speed is from, or since the last one if that is longer */
    /* the last reading */
    int32_t moved;        /* counts since the one before, */
    uint32_t step_clocks; /* which was so long ago, */
    uint32_t latch_clock; /* and when it was: the encoder's clock at the sample */
    /* the last edge */
    uint32_t count;
    int32_t backwards; /* 1: crossed downwards, so that it is the upper end of the count */
    uint32_t clock;
    int32_t beyond_q15;   /* how far the shaft is believed to have turned since then, rpm times milliseconds */
    bool lost;            /* its time is too long ago to mean anything */
    int32_t place_q16[4]; /* of the four edges of a line, from where they should be, in counts */
};

/* The counter has been set anew: nothing is known of the edges. Slow loop, or while it is masked. */
void speed_estimate_reset(struct speed_estimate *e);

/* Something else has measured until now, and its speed is there: from the last edge on the edges do. Slow loop. */
void speed_estimate_go_on(struct speed_estimate *e, const struct encoder_regs *encoder);

/* One step. Range: below 32767 rpm and a quarter of a turn a millisecond of change. Slow loop. */
void speed_estimate_step(struct speed_estimate *e, const struct encoder_regs *encoder, const struct tuning *t);

/* Of a step: by how many counts the shaft has moved, where the counter has gone round or it was more than a quarter. */
int32_t speed_estimate_unwrapped(int32_t moved, int32_t speed_rpm_q15, int32_t counts);

/* What something else has measured: speed, way of this millisecond, how long it takes. What edges told is lost. Slow loop. */
void speed_estimate_take(struct speed_estimate *e, int32_t speed_rpm_q15, int32_t travel_q15, uint32_t clocks);

#endif
