/* SPDX-License-Identifier: MIT */
/*
 * Whether each phase carries current and its sensor counts the right way, before anything turns: a voltage along one phase
 * after the other, raised until a small current flows. The voltage is held, not a current: a loop around a sensor of the
 * wrong sign would run away. The current stays below what the sum of the currents would trip at with one sensor reversed.
 *
 * Of two samples a period the slow loop meets the same one each millisecond, so it waits for the other: where the low sides are
 * off, shunts below them show nothing, whatever the drive was told.
 */
#ifndef FIRMWARE_COMMISSION_WIRING_H
#define FIRMWARE_COMMISSION_WIRING_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/adc.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"

enum wiring_result {
    WIRING_RUNNING,
    WIRING_GOOD,
    WIRING_OPEN, /* phase: carries less than 30 % of what the others do, or its sensor does not show it, or not always */
    WIRING_SIGN, /* phase: its sensor counts backwards */
};

struct wiring {
    uint32_t along;         /* phase along which the voltage stands */
    uint32_t ms;            /* at this voltage's rise, or since it went */
    int32_t v_256ths;       /* of the loop's voltage steps; 0 while the current dies away */
    int32_t before_q15[3];  /* the currents when the voltage began */
    int32_t own_q15[3];     /* by how much each phase's current rose with the voltage along it */
    int32_t largest_q15[3]; /* the most that each phase's current changed by with the voltage along any */
    bool blind[3];          /* a phase's current was there in one sample of a period and not in the other */
    int32_t phase;          /* that the verdict is about, 1 for A; 0: no phase carries current */
};

/* Slow loop, before the first step. */
void wiring_start(struct wiring *w);

/* One step a millisecond, 20 to 150 in all. The current loop holds voltages (WIRING_TUNING). Slow loop, bridge on. */
enum wiring_result wiring_step(struct wiring *w, volatile struct current_loop *c, const struct tuning *t,
                               const struct adc_regs *adc);

/* What current_loop_follow() is given meanwhile: gains of zero, so that the integrals hold the voltage. */
extern const struct tuning wiring_tuning;

#endif
