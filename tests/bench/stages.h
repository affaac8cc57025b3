/* SPDX-License-Identifier: MIT */
/*
 * The current loop once more, with a reading of the cycle counter between its stages, on a state of its own. The readings
 * keep the compiler from mixing one stage with the next and occupy two registers, so that the sum is more than the whole.
 */
#ifndef TESTS_BENCH_STAGES_H
#define TESTS_BENCH_STAGES_H

#include <stdint.h>

enum stage {
    STAGE_FETCH,     /* registers of ADC and encoder; acknowledge */
    STAGE_SCALE,     /* codes to Q15, reciprocal of the bus voltage */
    STAGE_OBSERVE,   /* angle and speed */
    STAGE_TRANSFORM, /* sine and cosine, Clarke, Park */
    STAGE_REGULATE,  /* decoupling, voltage circle, both PI controllers */
    STAGE_ADVANCE,   /* sine and cosine of the angle at which the voltages act */
    STAGE_MODULATE,  /* to on-times with dead-time compensation, and into CorePWM */
    STAGE_PUBLISH,   /* results for others */
    STAGE_PROTECT,   /* gate and encoder status, thresholds */
    STAGE_COUNT
};

struct current_loop;

/* The state that the stages work on. */
struct current_loop *stages_state(void);

/* One sample. counts[s]: the cycles of stage s, less those of the readings. */
void stages_run(uint32_t counts[STAGE_COUNT]);

/* Part of STAGE_MODULATE: the limits of the edges and the fourteen writes to CorePWM. */
void stage_write_pwm(uint32_t on_counts);

#endif
