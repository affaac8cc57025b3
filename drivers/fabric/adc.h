/* SPDX-License-Identifier: MIT */
/*
 * ADC sampler in fabric slot 1: three phase currents and the bus voltage, sampled simultaneously at the PWM's triggers, in Q15
 * of their ranges. Registers: docs/fabric.md, slot 1.
 */
#ifndef DRIVERS_FABRIC_ADC_H
#define DRIVERS_FABRIC_ADC_H

#include <stdbool.h>

#include "drivers/board.h"
#include "drivers/clear.h"
#include "drivers/fabric/offsets.h"
#include "drivers/reg.h"

struct adc_regs {
    volatile uint32_t CONTROL;
    volatile uint32_t STATUS;
    const volatile int32_t IA;
    const volatile int32_t IB;
    const volatile int32_t IC;
    const volatile int32_t VBUS;
    const volatile uint32_t SEQUENCE;
    volatile uint32_t OFFSET_A;
    volatile uint32_t OFFSET_B;
    volatile uint32_t OFFSET_C;
    volatile uint32_t I_TRIP;
    volatile uint32_t SUM_TRIP;
    volatile uint32_t V_MIN;
    volatile uint32_t V_MAX;
    const volatile uint32_t TEMP;
    const volatile uint32_t VALID;
    volatile uint32_t GAIN_A;
    volatile uint32_t GAIN_B;
    volatile uint32_t GAIN_C;
    volatile uint32_t SETTLE;
    volatile uint32_t MODULATOR;
    volatile uint32_t MODULATOR_TRIP;
};

#define ADC_CONTROL_ENABLE      (1u << 0)
#define ADC_CONTROL_IRQ_ENABLE  (1u << 1)
#define ADC_CONTROL_RECONSTRUCT (1u << 2)
#define ADC_CONTROL_MODULATORS  (1u << 3)
#define ADC_TEMP_CODES_PER_K    16
#define ADC_TEMP_CODE_AT_0_C    800
#define ADC_STATUS_EOC          (1u << 0)
#define ADC_STATUS_OVERRUN      (1u << 1)
#define ADC_STATUS_CURRENT      (1u << 4) /* of the newest conversion: a current beyond I_TRIP */
#define ADC_STATUS_SUM          (1u << 5) /* the sum of the currents beyond SUM_TRIP, for the second time in a row */
#define ADC_STATUS_VBUS_HIGH    (1u << 6)
#define ADC_STATUS_VBUS_LOW     (1u << 7)
#define ADC_STATUS_TRIP         (1u << 8) /* the fast path of a modulator was beyond its limit; stays until cleared */

/* One set of results, Q15 of the ranges. Out of the bridge is positive. */
struct adc_sample {
    int32_t ia_q15, ib_q15, ic_q15; /* -32767 ... +32767, offsets subtracted */
    int32_t vbus_q15;               /* 0 ... 32760 */
};

/*
 * Clears what is pending in the block and converts at every trigger from now on, with an interrupt at the end of each
 * conversion. The caller sets up the NVIC: priority, pending flag, enable. Context: thread.
 */
void adc_start(struct adc_regs *adc);

/* Period of the modulators' clock: 20 MHz. */
#define ADC_MODULATOR_CLOCKS (FABRIC_HZ / 20000000)

/*
 * Selects the source of the currents: the serial converters, with an osr of 0, or isolated modulators, whose results are of 3
 * osr bits after the trigger, 32, 64, 128 or 256. Beyond trip_q15, 0 ... 32767, their fast path, of 3 x 16 bits, switches the
 * bridge off (gate.h, OVERCURRENT). Shunts below the low sides: a phase whose low side had been on for less than settle_clocks
 * becomes minus the sum of the other two, unless another had, too; 0: sensors in line with the phases. From then on the block
 * converts with its interrupt, as after adc_start(); a conversion under way is dropped, unless nothing changes. Returns false
 * if a register does not read back. Context: thread or slow loop, bridge off.
 */
bool adc_select(struct adc_regs *adc, uint32_t osr, int32_t trip_q15, uint32_t settle_clocks);

/* No more conversions, and the interrupt line is low on return. A conversion under way is dropped. Context: any. */
void adc_stop(struct adc_regs *adc);

/*
 * Sets what the block subtracts from the currents: 16 times the code at zero current, 0 ... BOARD_ADC_OFFSET_MAX, in the order
 * A, B, C. In effect from the end of the next conversion on; one that ends between two of the stores uses new offsets for some
 * phases and old ones for the others. Context: one at a time.
 */
void adc_set_offsets(struct adc_regs *adc, const uint32_t offset_q15[3]);
void adc_offsets(const struct adc_regs *adc, uint32_t offset_q15[3]);

/*
 * Sets the Q15 limits: phase current, current sum, minimum and maximum bus voltage. ADC_STATUS flags what is beyond them. After
 * a reset nothing is. In effect from the end of the next conversion on. Context: any.
 */
#define ADC_LIMIT_NONE 0x1FFFF /* of a current and of the sum: nothing is beyond */
void adc_set_limits(struct adc_regs *adc, int32_t i_trip_q15, int32_t sum_trip_q15, int32_t v_min_q15,
                    int32_t v_max_q15);

/*
 * Takes the status bits and clears exactly those it saw: bits set in between are seen next time. Call it early in the handler:
 * a handler that returns before its line has dropped is entered again. The write is posted, but all fabric accesses take the
 * same path (FIC_0), in order: once a later read of any block has returned, the line has dropped. So a handler that goes on to
 * read the fabric need not wait here; any other calls adc_acknowledge().
 *
 * Returns ADC_STATUS_* bits. OVERRUN: a conversion before this one was never read. Context: the ISR of the block.
 */
static inline uint32_t adc_take_status(struct adc_regs *adc)
{
    const uint32_t status = adc->STATUS;
    reg_clear(&adc->STATUS, status);
    return status;
}

/* The same, and waits until the line has dropped, by reading back. Context: the ISR of the block. */
static inline uint32_t adc_acknowledge(struct adc_regs *adc)
{
    const uint32_t status = adc_take_status(adc);
    (void)adc->STATUS;
    return status;
}

/* ADC_STATUS_* bits. Context: any. */
static inline uint32_t adc_status(const struct adc_regs *adc)
{
    return adc->STATUS;
}

/* Forgets that there was an overrun. Context: any. */
static inline void adc_clear_overrun(struct adc_regs *adc)
{
    reg_clear(&adc->STATUS, ADC_STATUS_OVERRUN);
}

/*
 * The newest results, all four of the same conversion: if one ends between the reads, they are read again, once, since the next
 * is a PWM period away. Context: any.
 */
static inline struct adc_sample adc_read(const struct adc_regs *adc)
{
    struct adc_sample sample;
    uint32_t sequence;
    uint32_t attempts = 2;
    do {
        sequence = adc->SEQUENCE;
        sample = (struct adc_sample){.ia_q15 = adc->IA, .ib_q15 = adc->IB, .ic_q15 = adc->IC, .vbus_q15 = adc->VBUS};
        attempts--;
    } while (adc->SEQUENCE != sequence && attempts > 0u);
    return sample;
}

/* As adc_read(), for the next conversion; for the newest again if none ends within `polls` reads. Context: any. */
struct adc_sample adc_read_next(const struct adc_regs *adc, uint32_t polls);

/* Whether the newest results are three currents seen, none of them calculated from the others. Context: any. */
static inline bool adc_sees_all(const struct adc_regs *adc)
{
    return adc->VALID == 7u;
}

/* The newest bus voltage alone, Q15. Context: any. */
static inline int32_t adc_vbus_q15(const struct adc_regs *adc)
{
    return adc->VBUS;
}

/* Winding temperature, ADC_TEMP_CODES_PER_K above ADC_TEMP_CODE_AT_0_C; 0: no sensor, or no conversion yet. Context: any. */
static inline uint32_t adc_temperature_code(const struct adc_regs *adc)
{
    return adc->TEMP;
}

/* Conversions since the fabric's reset, modulo 2^32. Context: any. */
static inline uint32_t adc_sequence(const struct adc_regs *adc)
{
    return adc->SEQUENCE;
}

#endif
