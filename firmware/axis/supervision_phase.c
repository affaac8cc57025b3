/* SPDX-License-Identifier: MIT */
#include "firmware/axis/axis.h"
#include "firmware/axis/supervision.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define WINDOW_SHIFT 3 /* 8 ms */
#define SIN60_Q15    28378
#define SILENT_SHIFT 3 /* less than an eighth of what is asked for is nothing */
#define LEAST        4 /* milliseconds of a tenth of i_max */

void supervise_phases_begin(struct axis *a)
{
    a->supervision.phases = (struct phase_watch){.enough_q15 = a->tuning.i_max_q15 / 10 * LEAST};
}

static void add(int32_t *sum_q15, int32_t i_q15)
{
    *sum_q15 += q15_abs(i_q15) - (*sum_q15 >> WINDOW_SHIFT);
}

static bool silent(const struct phase_watch *p, uint32_t phase)
{
    return p->asked_q15[phase] > p->enough_q15 && p->measured_q15[phase] < p->asked_q15[phase] >> SILENT_SHIFT;
}

void supervise_phases(struct axis *a)
{
    struct phase_watch *const p = &a->supervision.phases;
    const cossin_t cs = cossin_q15(a->loop.pll.angle_q32 + a->loop.angle_offset_q32);
    const int32_t d_q15 = a->loop.i_d_ref_q15;
    const int32_t q_q15 = a->loop.i_q_ref_q15;
    const int32_t alpha_q15 = (d_q15 * cs.cos - q_q15 * cs.sin) >> 15;
    const int32_t beta_q15 = (d_q15 * cs.sin + q_q15 * cs.cos) >> 15;
    const int32_t b_q15 = ((beta_q15 * SIN60_Q15) >> 15) - (alpha_q15 >> 1);
    add(&p->asked_q15[0], alpha_q15);
    add(&p->asked_q15[1], b_q15);
    add(&p->asked_q15[2], alpha_q15 + b_q15);
    add(&p->measured_q15[0], a->fabric->adc.IA);
    add(&p->measured_q15[1], a->fabric->adc.IB);
    add(&p->measured_q15[2], a->fabric->adc.IC);
    const uint32_t open = (silent(p, 0) ? 1u : 0u) | (silent(p, 1) ? 2u : 0u) | (silent(p, 2) ? 4u : 0u);
    if (open != 0u) {
        axis_report(a, FAULT_OPEN_PHASE, (int32_t)open, 0);
    }
}
