/* SPDX-License-Identifier: MIT */
/* Zeros of the current sensors: the mean of their codes while the bridge is off and no current can flow. */
#ifndef FIRMWARE_COMMISSION_CALIBRATION_H
#define FIRMWARE_COMMISSION_CALIBRATION_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/adc.h"

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

#endif
