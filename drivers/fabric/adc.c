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
