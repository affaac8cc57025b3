/* SPDX-License-Identifier: MIT */
#include "drivers/fabric/reset.h"

static void reset_gate(struct gate_regs *gate)
{
    gate_disable(gate);
    gate->CHOPPER = 0u;
    gate->CHOPPER_ON = RESET_CHOPPER;
    gate->CHOPPER_OFF = RESET_CHOPPER;
}

static void reset_adc(struct adc_regs *adc)
{
    adc_stop(adc);
    reg_clear(&adc->STATUS, ADC_STATUS_TRIP);
    adc->OFFSET_A = BOARD_ADC_OFFSET_NOMINAL;
    adc->OFFSET_B = BOARD_ADC_OFFSET_NOMINAL;
    adc->OFFSET_C = BOARD_ADC_OFFSET_NOMINAL;
    adc->I_TRIP = RESET_NO_LIMIT;
    adc->SUM_TRIP = RESET_NO_LIMIT;
    adc->V_MIN = 0u;
    adc->V_MAX = RESET_NO_LIMIT;
    adc->GAIN_A = 0u;
    adc->GAIN_B = 0u;
    adc->GAIN_C = 0u;
    adc->SETTLE = 0u;
    adc->MODULATOR = RESET_MODULATOR;
    adc->MODULATOR_TRIP = RESET_NO_LIMIT;
}

void fabric_reset(struct fabric *fabric)
{
    reset_gate(&fabric->gate);
    fabric->pwm.CONTROL = 0u; /* a carrier that runs would trigger the ADC */
    reset_adc(&fabric->adc);
    fabric->encoder.FILTER = 0u;
    (void)gate_clear(&fabric->gate, GATE_STATUS_LATCHES); /* last: what was on may have been the cause */
}
