/* SPDX-License-Identifier: MIT */
/*
 * ADC sampler in fabric slot 1: three phase currents and the bus voltage, taken at the same instant once a PWM period.
 * Registers: docs/fabric.md, slot 1.
 */
#ifndef DRIVERS_FABRIC_ADC_H
#define DRIVERS_FABRIC_ADC_H

#include "drivers/board.h"
#include "drivers/reg.h"

struct adc_regs {
    volatile uint32_t CONTROL;
    volatile uint32_t STATUS;
    const volatile uint32_t IA;
    const volatile uint32_t IB;
    const volatile uint32_t IC;
    const volatile uint32_t VBUS;
    const volatile uint32_t SEQUENCE;
};

REG_AT_OFFSET(struct adc_regs, CONTROL, 0x00);
REG_AT_OFFSET(struct adc_regs, STATUS, 0x04);
REG_AT_OFFSET(struct adc_regs, IA, 0x08);
REG_AT_OFFSET(struct adc_regs, IB, 0x0C);
REG_AT_OFFSET(struct adc_regs, IC, 0x10);
REG_AT_OFFSET(struct adc_regs, VBUS, 0x14);
REG_AT_OFFSET(struct adc_regs, SEQUENCE, 0x18);

#define ADC REG_BLOCK(struct adc_regs, BOARD_ADC_BASE)

#define ADC_CONTROL_ENABLE     (1u << 0)
#define ADC_CONTROL_IRQ_ENABLE (1u << 1)
#define ADC_STATUS_EOC         (1u << 0)
#define ADC_STATUS_OVERRUN     (1u << 1)

/* One set of results: codes 0 ... 4095. Currents: BOARD_ADC_MID_CODE at about 0 A, out of the bridge counts up. */
struct adc_sample {
    uint32_t ia, ib, ic;
    uint32_t vbus; /* 0 at 0 V */
};

/*
 * Clears what is pending and responds to every trigger from now on, with an interrupt (BOARD_IRQ_ADC) at the end of
 * each conversion. The caller enables the interrupt in the NVIC at the priority it wants. Context: thread.
 */
void adc_start(void);

/* No more conversions, no interrupt pending. One under way when it is called is dropped. Context: any. */
void adc_stop(void);

/*
 * Takes the status bits and clears exactly those it saw: what comes up in between is seen next time. The write goes out
 * over two bridges and is read back, because an interrupt handler that returns before its line has dropped is entered
 * again. Call it first thing in the handler.
 *
 * Returns ADC_STATUS_* bits. OVERRUN: a conversion before this one was never read. Context: ISR of BOARD_IRQ_ADC.
 */
static inline uint32_t adc_acknowledge(void)
{
    const uint32_t status = ADC->STATUS;
    ADC->STATUS = status;
    (void)ADC->STATUS;
    return status;
}

/* The newest results; all four of the same instant until the next conversion ends. Context: ISR of BOARD_IRQ_ADC. */
static inline struct adc_sample adc_read(void)
{
    const struct adc_sample sample = {.ia = ADC->IA, .ib = ADC->IB, .ic = ADC->IC, .vbus = ADC->VBUS};
    return sample;
}

/* Conversions since the fabric's reset, modulo 2^32. Context: any. */
static inline uint32_t adc_sequence(void)
{
    return ADC->SEQUENCE;
}

#endif
