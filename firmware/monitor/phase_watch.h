/* SPDX-License-Identifier: MIT */
/* Finds a phase that should carry current and does not. */
#ifndef FIRMWARE_MONITOR_PHASE_WATCH_H
#define FIRMWARE_MONITOR_PHASE_WATCH_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

/* Phases: what references and angle asked of each while it carried no current. */
struct phase_watch {
    int32_t missing_q15[3];           /* sums, one term every second millisecond */
    int32_t i_d_ref_q15, i_q_ref_q15; /* of the previous millisecond: what the currents have followed since */
    int32_t least_q15;                /* smallest that can be told from zero */
    int32_t carried_q15;              /* by all phases, in the last few looks */
};

/* Starts, from the parameters. Slow loop, when operation begins. */
void phase_watch_begin(struct axis *a);

/* The references that the currents follow until the phases are checked. Slow loop, in the millisecond before. */
void phase_watch_expect(struct axis *a);

/* Slow loop, every second millisecond. */
void phase_watch_step(struct axis *a);

/*
 * True if a phase has begun to carry nothing, and which (as in the fault's detail): too briefly for a fault of its own, long
 * enough to be the cause of an over-current or a lost speed. Any context.
 */
bool phase_watch_suspects(const struct axis *a, int32_t *phase);

#endif
