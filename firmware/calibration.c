/* SPDX-License-Identifier: MIT */
#include "firmware/calibration.h"

#include <stdint.h>

#include "drivers/fabric/adc.h"

#define SAMPLES_LOG2 7
#define SAMPLES      (1 << SAMPLES_LOG2)
#define NOMINAL      ((int32_t)BOARD_ADC_OFFSET_NOMINAL)
#define ALLOWED      (102 * BOARD_ADC_Q15_PER_CODE) /* 5 % of 2048 codes */

static int32_t count;
static int32_t sum_q15[3];

void calibration_start(void)
{
    count = 0;
    sum_q15[0] = 0;
    sum_q15[1] = 0;
    sum_q15[2] = 0;
}

/* Rounded to nearest; a shift, because a division would round towards zero. */
static int32_t mean_q15(int32_t of_sum_q15)
{
    return (of_sum_q15 + SAMPLES / 2) >> SAMPLES_LOG2;
}

/* The samples have the present offsets subtracted already: what is left of them is what the offsets lack. */
static enum calibration_result finish(void)
{
    uint32_t offset_q15[3];
    adc_offsets(offset_q15);
    for (unsigned i = 0; i < 3; i++) {
        const int32_t corrected = (int32_t)offset_q15[i] + mean_q15(sum_q15[i]);
        if (corrected < NOMINAL - ALLOWED || corrected > NOMINAL + ALLOWED) {
            return CALIBRATION_OUT_OF_RANGE;
        }
        offset_q15[i] = (uint32_t)corrected;
    }
    adc_set_offsets(offset_q15);
    return CALIBRATION_DONE;
}

enum calibration_result calibration_step(void)
{
    const struct adc_sample sample = adc_read();
    sum_q15[0] += sample.ia_q15;
    sum_q15[1] += sample.ib_q15;
    sum_q15[2] += sample.ic_q15;
    count++;
    return count < SAMPLES ? CALIBRATION_RUNNING : finish();
}
