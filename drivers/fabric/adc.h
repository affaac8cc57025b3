/* SPDX-License-Identifier: MIT */
/*
 * ADC sampler in fabric slot 1: three phase currents and the bus voltage, taken at the same instant once a PWM period, with
 * their offsets taken off and compared with limits.
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
    volatile uint32_t OFFSET_A;
    volatile uint32_t OFFSET_B;
    volatile uint32_t OFFSET_C;
    volatile uint32_t I_TRIP;
    volatile uint32_t SUM_TRIP;
    volatile uint32_t V_MIN;
    volatile uint32_t V_MAX;
};

REG_AT_OFFSET(struct adc_regs, CONTROL, 0x00);
REG_AT_OFFSET(struct adc_regs, STATUS, 0x04);
REG_AT_OFFSET(struct adc_regs, IA, 0x08);
REG_AT_OFFSET(struct adc_regs, IB, 0x0C);
REG_AT_OFFSET(struct adc_regs, IC, 0x10);
REG_AT_OFFSET(struct adc_regs, VBUS, 0x14);
REG_AT_OFFSET(struct adc_regs, SEQUENCE, 0x18);
REG_AT_OFFSET(struct adc_regs, OFFSET_A, 0x1C);
REG_AT_OFFSET(struct adc_regs, OFFSET_B, 0x20);
REG_AT_OFFSET(struct adc_regs, OFFSET_C, 0x24);
REG_AT_OFFSET(struct adc_regs, I_TRIP, 0x28);
REG_AT_OFFSET(struct adc_regs, SUM_TRIP, 0x2C);
REG_AT_OFFSET(struct adc_regs, V_MIN, 0x30);
REG_AT_OFFSET(struct adc_regs, V_MAX, 0x34);

#define ADC REG_BLOCK(struct adc_regs, BOARD_ADC_BASE)

#define ADC_CONTROL_ENABLE     (1u << 0)
#define ADC_CONTROL_IRQ_ENABLE (1u << 1)
#define ADC_STATUS_EOC         (1u << 0)
#define ADC_STATUS_OVERRUN     (1u << 1)
#define ADC_STATUS_CURRENT     (1u << 4) /* of the newest conversion: a current beyond I_TRIP */
#define ADC_STATUS_SUM         (1u << 5) /* the sum of the currents beyond SUM_TRIP, for the second time in a row */
#define ADC_STATUS_VBUS_HIGH   (1u << 6)
#define ADC_STATUS_VBUS_LOW    (1u << 7)

#define ADC_LIMIT_NONE 0x1FFFFu

/* One set of results, Q15 of the measuring range: currents +-32767, out of the bridge positive; bus voltage 0...32760. */
struct adc_sample {
    int32_t ia_q15, ib_q15, ic_q15;
    int32_t vbus_q15;
};

/*
 * Clears what is pending and responds to every trigger from now on, with an interrupt (BOARD_IRQ_ADC) at the end of
 * each conversion. The caller enables the interrupt in the NVIC at the priority it wants. Context: thread.
 */
void adc_start(void);

/* No more conversions, no interrupt pending. One under way when it is called is dropped. Context: any. */
void adc_stop(void);

/*
 * What to take off each current, in Q15: BOARD_ADC_OFFSET_Q15 and what the sensor adds to it, 17 bits. In effect from the
 * next end of a conversion on. Context: any.
 */
static inline void adc_set_offsets(uint32_t a_q15, uint32_t b_q15, uint32_t c_q15)
{
    ADC->OFFSET_A = a_q15;
    ADC->OFFSET_B = b_q15;
    ADC->OFFSET_C = c_q15;
}

/*
 * Beyond which magnitude of a current, which magnitude of the currents' sum, below and above which bus voltage the flags
 * of ADC_STATUS are set, Q15. In effect from the next end of a conversion on. Context: any.
 */
static inline void adc_set_limits(int32_t i_trip_q15, int32_t sum_trip_q15, int32_t v_min_q15, int32_t v_max_q15)
{
    ADC->I_TRIP = (uint32_t)i_trip_q15;
    ADC->SUM_TRIP = (uint32_t)sum_trip_q15;
    ADC->V_MIN = (uint32_t)v_min_q15;
    ADC->V_MAX = (uint32_t)v_max_q15;
}

/* ADC_STATUS_* bits; OVERRUN: a conversion ended while the one before had not been acknowledged. Context: any. */
static inline uint32_t adc_status(void)
{
    return ADC->STATUS;
}

/*
 * This conversion is taken; the line drops. The write goes out over two bridges: a handler that returned before the line
 * has dropped would be entered again. So it comes early in the handler, or the handler reads something in the fabric after
 * it. Context: ISR of BOARD_IRQ_ADC.
 */
static inline void adc_acknowledge(void)
{
    ADC->STATUS = ADC_STATUS_EOC;
}

/* Forgets that there was an overrun. Context: any. */
static inline void adc_clear_overrun(void)
{
    ADC->STATUS = ADC_STATUS_OVERRUN;
}

/*
 * The newest results. All four are of the same instant in the ISR of BOARD_IRQ_ADC; elsewhere a conversion may end between
 * the reads. Context: any.
 */
static inline struct adc_sample adc_read(void)
{
    return (struct adc_sample){.ia_q15 = (int32_t)ADC->IA,
                               .ib_q15 = (int32_t)ADC->IB,
                               .ic_q15 = (int32_t)ADC->IC,
                               .vbus_q15 = (int32_t)ADC->VBUS};
}

/* Conversions since the fabric's reset, modulo 2^32. Context: any. */
static inline uint32_t adc_sequence(void)
{
    return ADC->SEQUENCE;
}

#endif
