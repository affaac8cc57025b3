/* SPDX-License-Identifier: MIT */
#ifndef FIRMWARE_COMMISSION_WIRING_H
#define FIRMWARE_COMMISSION_WIRING_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/adc.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"

/* ==== the sensors' zeros ==== */

/* Zeros of the current sensors: the mean of their codes while the bridge is off and no current can flow. */

#define CALIBRATION_MS 128 /* duration, one sample each */

enum calibration_result {
    CALIBRATION_RUNNING,
    CALIBRATION_DONE,
    CALIBRATION_OUT_OF_RANGE, /* a zero is more than 5 % of the range from mid-scale; the old values stay */
};

struct calibration {
    int32_t count;
    int32_t sum_q15[3];
};

/* Starts over. Slow loop, bridge off. */
void calibration_start(struct calibration *k);

/* One sample a millisecond, CALIBRATION_MS of them: noise of 1 LSB rms leaves 0.09 LSB. Slow loop, bridge off. */
enum calibration_result calibration_step(struct calibration *k, struct adc_regs *adc);

/* ==== the phases ==== */

/*
 * Checks, before anything turns, that each phase carries current and its sensor is its own and has the right sign: a voltage
 * along one phase after another, raised until a small current flows. The voltage is held, not a current: a loop around a sensor
 * of the wrong sign would run away. The current stays below what would trip the current-sum check with one sensor reversed.
 *
 * Of two samples a period the slow loop meets the same one each millisecond, so it waits for the other: while the low sides are
 * off, shunts below them show nothing, whatever the drive was told.
 */

enum wiring_result {
    WIRING_RUNNING,
    WIRING_GOOD,
    WIRING_OPEN, /* phase: carries less than 30 % of what the others do, or its sensor does not show it, or not always */
    WIRING_SIGN,      /* phase: its sensor counts backwards */
    WIRING_EXCHANGED, /* phase: three digits, whose current the sensors of A, B and C show; 213: A and B are exchanged */
};

struct wiring {
    uint32_t along;         /* phase along which the voltage is applied */
    uint32_t ms;            /* since this voltage's rise began, or since it ended */
    int32_t v_256ths;       /* of the loop's voltage steps; 0 while the current decays */
    int32_t before_q15[3];  /* the currents when the voltage began */
    int32_t rise_q15[3][3]; /* with the voltage along a phase, of what each sensor shows */
    bool slow;              /* the second time: currents come to rest before each voltage */
    bool blind[3];          /* a phase's current showed in one sample of a period but not in the other */
    int32_t phase;          /* the verdict's phase, 1 for A; 0: no phase carries current */
};

/*
 * Slow loop, before the first step. `patient`: the second time, behind one that found a sign or an order wrong. That may have
 * come of what flows by itself, where the stage's own error drives more at no voltage than the test, or of a rotor that slips.
 */
void wiring_start(struct wiring *w, bool slow);

/*
 * One step a millisecond, 20 to 150 in all, 500 if patient. The current loop holds voltages (WIRING_TUNING). Slow loop, bridge
 * on.
 */
enum wiring_result wiring_step(struct wiring *w, volatile struct current_loop *c, const struct tuning *t,
                               const struct adc_regs *adc);

/* For current_loop_follow() meanwhile: gains of zero, so the integrals hold the voltage. */
extern const struct tuning wiring_tuning;

#endif
