/* SPDX-License-Identifier: MIT */
/*
 * Counts lost one by one, seen by what the back-EMF becomes. How far it may be off the q axis from the beginning is as much
 * as dead time, resistance and Lq are unknown (control/emf.h), and Lq is learnt, which under load hides a slip. But at one
 * speed and current all of that stays as it is: so the EMF across the rotor is remembered, at the Lq known then, and what
 * it has changed by is the slip's. Another speed or current, asked for, begins anew.
 *
 * Voltages Q15 of v_range, currents Q15 of i_range, speed as current_loop_w_q15(). Context: slow loop, each second millisecond.
 */
#ifndef FIRMWARE_MONITOR_SLIP_WATCH_H
#define FIRMWARE_MONITOR_SLIP_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/emf.h"

/* What is remembered. All zero: nothing yet. */
struct slip_watch {
    int32_t i_d_q15, i_q_q15, w_q15; /* the currents asked for and the speed, */
    int32_t lq_q19;                  /* the Lq that was known then, */
    int32_t across_q15;              /* and the EMF's d component; until enough steps were seen, their sum */
    int32_t changed_q15;             /* by how much it has changed since, filtered as the EMF is */
    int32_t elsewhere;               /* steps in a row at another speed or current */
    int32_t steps;                   /* seen of what is remembered */
    int32_t against;                 /* steps in which that was too much */
};

/*
 * One step with the present voltages; `e` is that of the last milliseconds. True if the rotor has turned away by about 11
 * degrees, and what a change of speed and current may explain, for three steps.
 */
bool slip_watch_step(struct slip_watch *s, const struct emf *e, const volatile struct current_loop *c,
                     const struct tuning *t);

#endif
