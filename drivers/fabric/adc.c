/* SPDX-License-Identifier: MIT */
#include "drivers/fabric/adc.h"

#include "drivers/cortex/nvic.h"

void adc_start(void)
{
    adc_stop();
    ADC->CONTROL = ADC_CONTROL_ENABLE | ADC_CONTROL_IRQ_ENABLE;
}

void adc_stop(void)
{
    ADC->CONTROL = 0u;
    ADC->STATUS = ADC_STATUS_EOC | ADC_STATUS_OVERRUN;
    (void)ADC->STATUS; /* the line is low before the NVIC forgets it */
    nvic_clear_pending(BOARD_IRQ_ADC);
}

void adc_set_offsets(const uint32_t offset_q15[3])
{
    ADC->OFFSET_A = offset_q15[0];
    ADC->OFFSET_B = offset_q15[1];
    ADC->OFFSET_C = offset_q15[2];
}

void adc_offsets(uint32_t offset_q15[3])
{
    offset_q15[0] = ADC->OFFSET_A;
    offset_q15[1] = ADC->OFFSET_B;
    offset_q15[2] = ADC->OFFSET_C;
}

void adc_set_limits(int32_t i_trip_q15, int32_t sum_trip_q15, int32_t v_min_q15, int32_t v_max_q15)
{
    ADC->I_TRIP = (uint32_t)i_trip_q15;
    ADC->SUM_TRIP = (uint32_t)sum_trip_q15;
    ADC->V_MIN = (uint32_t)v_min_q15;
    ADC->V_MAX = (uint32_t)v_max_q15;
}
