/* SPDX-License-Identifier: MIT */
#include "firmware/calibration.h"

#include <stdint.h>

#include "drivers/fabric/adc.h"

#define SAMPLES     128 /* 2^7 */
#define NOMINAL_Q15 ((int32_t)BOARD_ADC_OFFSET_Q15)
#define ALLOWED_Q15 (NOMINAL_Q15 / 20) /* 5 % */

static int32_t count;
static int32_t sum_q15[3];

static void set_offsets(const int32_t error_q15[3])
{
    adc_set_offsets((uint32_t)(NOMINAL_Q15 + error_q15[0]), (uint32_t)(NOMINAL_Q15 + error_q15[1]),
                    (uint32_t)(NOMINAL_Q15 + error_q15[2]));
}

void calibration_start(void)
{
    static const int32_t none[3] = {0, 0, 0};
    count = -1; /* the sample after the next conversion is the first without offset */
    sum_q15[0] = 0;
    sum_q15[1] = 0;
    sum_q15[2] = 0;
    set_offsets(none);
}

static enum calibration_result finish(void)
{
    int32_t error_q15[3];
    for (unsigned i = 0; i < 3; i++) {
        error_q15[i] = (sum_q15[i] + SAMPLES / 2) >> 7;
        if (error_q15[i] < -ALLOWED_Q15 || error_q15[i] > ALLOWED_Q15) {
            return CALIBRATION_OUT_OF_RANGE;
        }
    }
    set_offsets(error_q15);
    return CALIBRATION_DONE;
}

enum calibration_result calibration_step(void)
{
    const struct adc_sample sample = adc_read();
    if (count >= 0) {
        sum_q15[0] += sample.ia_q15;
        sum_q15[1] += sample.ib_q15;
        sum_q15[2] += sample.ic_q15;
    }
    count++;
    return count < SAMPLES ? CALIBRATION_RUNNING : finish();
}
