/* SPDX-License-Identifier: MIT */
#include "firmware/commission/calibration.h"

#define SAMPLES_LOG2 7
#define SAMPLES      CALIBRATION_MS

_Static_assert(SAMPLES == 1 << SAMPLES_LOG2, "a mean is a shift");
#define NOMINAL ((int32_t)BOARD_ADC_OFFSET_NOMINAL)
#define ALLOWED (102 * BOARD_ADC_Q15_PER_CODE) /* 5 % of 2048 codes */

void calibration_start(struct calibration *k)
{
    k->count = 0;
    k->sum_q15[0] = 0;
    k->sum_q15[1] = 0;
    k->sum_q15[2] = 0;
}

/* Rounded to nearest; a shift, because a division would round towards zero. */
static int32_t mean_q15(int32_t of_sum_q15)
{
    return (of_sum_q15 + SAMPLES / 2) >> SAMPLES_LOG2;
}

/* The samples have the present offsets subtracted already: what remains is the offsets' error. */
static enum calibration_result calibration_finish(const struct calibration *k, struct adc_regs *adc)
{
    uint32_t offset_q15[3];
    adc_offsets(adc, offset_q15);
    for (unsigned i = 0; i < 3; i++) {
        const int32_t corrected = (int32_t)offset_q15[i] + mean_q15(k->sum_q15[i]);
        if (corrected < NOMINAL - ALLOWED || corrected > NOMINAL + ALLOWED) {
            return CALIBRATION_OUT_OF_RANGE;
        }
        offset_q15[i] = (uint32_t)corrected;
    }
    adc_set_offsets(adc, offset_q15);
    return CALIBRATION_DONE;
}

enum calibration_result calibration_step(struct calibration *k, struct adc_regs *adc)
{
    const struct adc_sample sample = adc_read(adc);
    k->sum_q15[0] += sample.ia_q15;
    k->sum_q15[1] += sample.ib_q15;
    k->sum_q15[2] += sample.ic_q15;
    k->count++;
    return k->count < SAMPLES ? CALIBRATION_RUNNING : calibration_finish(k, adc);
}
