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
 * Checks, before anything turns, that each phase conducts and that its sensor is the right one with the right sign: a voltage
 * along one phase after another, increased until a small current flows. The voltage is held, because a current loop with a
 * wrong sign would be unstable. The current is too small to trip the current-sum check with one sensor reversed.
 *
 * Of two samples a period the slow loop sees the same one each millisecond, so it waits for the other one as well: with
 * low-side shunts it would show nothing, if the parameters are wrong.
 */

enum wiring_result {
    WIRING_RUNNING,
    WIRING_GOOD,
    WIRING_OPEN, /* phase: less than 30 % of the others' current, or its sensor does not show it in both samples */
    WIRING_SIGN, /* phase: its sensor has the wrong sign */
    /* phase: three digits, whose current the sensors of A, B and C show; 213: A and B are exchanged */
    WIRING_EXCHANGED,
};

struct wiring {
    uint32_t along;         /* phase along which the voltage is applied */
    uint32_t ms;            /* since this voltage started to rise, or ended */
    int32_t v_256ths;       /* of the loop's voltage steps; 0 while the current decays */
    int32_t before_q15[3];  /* the currents when the voltage began */
    int32_t rise_q15[3][3]; /* by the phase of the voltage, change of each sensor's current */
    bool slow;              /* repeated: waits for zero current before each voltage */
    bool blind[3];          /* a phase's current showed in one sample of a period but not in the other */
    int32_t phase;          /* the verdict's phase, 1 for A; 0: no phase carries current */
};

/*
 * Slow loop, before the first step. `slow`: repeated after a wrong sign or order, which may have been caused by a residual
 * current, from the stage's voltage error, or by a rotor that moved.
 */
void wiring_start(struct wiring *w, bool slow);

/*
 * One step a millisecond, 20 to 150 in all, 500 if slow. The current loop holds voltages (WIRING_TUNING). Slow loop, bridge on.
 */
enum wiring_result wiring_step(struct wiring *w, volatile struct current_loop *c, const struct tuning *t,
                               const struct adc_regs *adc);

/* For current_loop_follow() meanwhile: zero gains, so that the integrals hold the voltage. */
extern const struct tuning wiring_tuning;

#endif
