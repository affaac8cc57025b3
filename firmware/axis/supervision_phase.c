/* SPDX-License-Identifier: MIT */
#include "firmware/axis/axis.h"
#include "firmware/axis/supervision.h"
#include "firmware/axis/supervision_phase_step.h"

#define SUSPECT 2 /* of the smallest terms: a phase that may be the cause of something else */

void supervise_phases_begin(struct axis *a)
{
    a->supervision.phases = (struct phase_watch){.least_q15 = a->tuning.i_max_q15 >> PHASES_LEAST_SHIFT};
}

bool supervise_phases_suspect(const struct axis *a, int32_t *phase)
{
    const struct phase_watch *const p = &a->supervision.phases;
    const bool running = a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
    const int32_t least_q15 = p->least_q15 * SUSPECT;
    const bool a_open = p->missing_q15[0] > least_q15;
    const bool b_open = p->missing_q15[1] > least_q15;
    const bool c_open = p->missing_q15[2] > least_q15;
    *phase = phases_open_one(a_open, b_open, c_open);
    return running && !sensorless_doubts(a) && (a_open || b_open || c_open);
}

void supervise_phases(struct axis *a)
{
    supervise_phases_here(a);
}
