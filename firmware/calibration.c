/* SPDX-License-Identifier: MIT */
#include "firmware/calibration.h"

#include <stdint.h>

#include "drivers/fabric/adc.h"
#include "firmware/current_loop.h"

#define SAMPLES      128u
#define MID_SCALE_Q4 (2048 * 16)
#define ALLOWED_Q4   (102 * 16) /* 5 % of 2048 codes */

static uint32_t count;
static uint32_t sum[3];

void calibration_start(void)
{
    count = 0;
    sum[0] = 0;
    sum[1] = 0;
    sum[2] = 0;
}

static enum calibration_result finish(void)
{
    int32_t offset_q4[3];
    for (unsigned i = 0; i < 3; i++) {
        offset_q4[i] = (int32_t)((sum[i] * 16u + SAMPLES / 2u) / SAMPLES);
        if (offset_q4[i] < MID_SCALE_Q4 - ALLOWED_Q4 || offset_q4[i] > MID_SCALE_Q4 + ALLOWED_Q4) {
            return CALIBRATION_OUT_OF_RANGE;
        }
    }
    for (unsigned i = 0; i < 3; i++) {
        current_loop.offset_q4[i] = offset_q4[i];
    }
    return CALIBRATION_DONE;
}

enum calibration_result calibration_step(void)
{
    const struct adc_sample sample = adc_read();
    sum[0] += sample.ia;
    sum[1] += sample.ib;
    sum[2] += sample.ic;
    count++;
    return count < SAMPLES ? CALIBRATION_RUNNING : finish();
}
