/* SPDX-License-Identifier: MIT */
#include "drivers/fabric/adc.h"

void adc_start(struct adc_regs *adc)
{
    adc_stop(adc);
    adc->CONTROL = ADC_CONTROL_ENABLE | ADC_CONTROL_IRQ_ENABLE;
}

/* OSR, and 16 bits in the fast path. */
static uint32_t modulator_setting(uint32_t osr)
{
    uint32_t log2 = 0;
    for (uint32_t bits = osr; bits > 32u; bits >>= 1) {
        log2++;
    }
    return log2 | 1u << 4 | (uint32_t)ADC_MODULATOR_CLOCKS << 8;
}

/* Stopped, so that no result is of the old source. */
bool adc_select(struct adc_regs *adc, uint32_t osr, int32_t trip_q15, uint32_t settle_clocks)
{
    const uint32_t of_modulators = osr == 0u ? 0u : ADC_CONTROL_MODULATORS;
    const uint32_t of_shunts = settle_clocks == 0u ? 0u : ADC_CONTROL_RECONSTRUCT;
    const uint32_t control = ADC_CONTROL_ENABLE | ADC_CONTROL_IRQ_ENABLE | of_modulators | of_shunts;
    const uint32_t setting = osr == 0u ? adc->MODULATOR : modulator_setting(osr);
    adc->MODULATOR_TRIP = (uint32_t)trip_q15;
    adc->SETTLE = settle_clocks;
    if (adc->CONTROL != control || adc->MODULATOR != setting) {
        adc_stop(adc);
        adc->MODULATOR = setting;
        adc->CONTROL = control;
    }
    return adc->CONTROL == control && adc->MODULATOR == setting && adc->MODULATOR_TRIP == (uint32_t)trip_q15 &&
           adc->SETTLE == settle_clocks;
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
