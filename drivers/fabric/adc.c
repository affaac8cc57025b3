/* SPDX-License-Identifier: MIT */
#include "drivers/fabric/adc.h"

void adc_start(struct adc_regs *adc)
{
    adc_stop(adc);
    adc->CONTROL = ADC_CONTROL_ENABLE | ADC_CONTROL_IRQ_ENABLE;
}

void adc_stop(struct adc_regs *adc)
{
    adc->CONTROL = 0u;
    reg_clear(&adc->STATUS, ADC_STATUS_EOC | ADC_STATUS_OVERRUN);
    (void)adc->STATUS; /* read back: the line has dropped when this returns */
}

void adc_set_offsets(struct adc_regs *adc, const uint32_t offset_q15[3])
{
    adc->OFFSET_A = offset_q15[0];
    adc->OFFSET_B = offset_q15[1];
    adc->OFFSET_C = offset_q15[2];
}

void adc_offsets(const struct adc_regs *adc, uint32_t offset_q15[3])
{
    offset_q15[0] = adc->OFFSET_A;
    offset_q15[1] = adc->OFFSET_B;
    offset_q15[2] = adc->OFFSET_C;
}

void adc_set_limits(struct adc_regs *adc, int32_t i_trip_q15, int32_t sum_trip_q15, int32_t v_min_q15,
                    int32_t v_max_q15)
{
    adc->I_TRIP = (uint32_t)i_trip_q15;
    adc->SUM_TRIP = (uint32_t)sum_trip_q15;
    adc->V_MIN = (uint32_t)v_min_q15;
    adc->V_MAX = (uint32_t)v_max_q15;
}

struct adc_sample adc_read_next(const struct adc_regs *adc, uint32_t polls)
{
    const uint32_t newest = adc->SEQUENCE;
    for (uint32_t poll = 0; poll < polls && adc->SEQUENCE == newest; poll++) {
        /* bounded */
    }
    return adc_read(adc);
}
