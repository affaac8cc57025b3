/* SPDX-License-Identifier: MIT */
/*
 * MSS GPIO, 32 pins (UG0331, GPIO chapter). Which of them reach a pin or the fabric is set in Libero.
 */
#ifndef DRIVERS_MSS_GPIO_H
#define DRIVERS_MSS_GPIO_H

#include "drivers/reg.h"

struct gpio_regs {
    volatile uint32_t GPIO_CFG[32];
    volatile uint32_t GPIO_IRQ;
    const volatile uint32_t GPIO_IN;
    volatile uint32_t GPIO_OUT;
};

REG_AT_OFFSET(struct gpio_regs, GPIO_CFG, 0x00);
REG_AT_OFFSET(struct gpio_regs, GPIO_IRQ, 0x80);
REG_AT_OFFSET(struct gpio_regs, GPIO_IN, 0x84);
REG_AT_OFFSET(struct gpio_regs, GPIO_OUT, 0x88);

#define GPIO_BASE 0x40013000u
#define GPIO      REG_BLOCK(struct gpio_regs, GPIO_BASE)

/* Each bit of a peripheral register is a word of its own here (UG0331, Cortex-M3 memory map). */
#define GPIO_BIT_BAND_OF 0x40000000u
#define GPIO_BIT_BAND    0x42000000u

#define GPIO_CFG_OUTPUT        (1u << 0)
#define GPIO_CFG_INPUT         (1u << 1)
#define GPIO_CFG_OUTPUT_BUFFER (1u << 2)
#define GPIO_PINS              32u

/* All functions: pin 0 ... 31; a larger number does nothing and reads as false. */

/* Releases the resets of the block and of its output bytes. Context: thread, before the others. */
void gpio_init(void);

/*
 * Drives the pin to the last gpio_write() level; it can be read back. Write first: the level after a reset is the design's, and
 * high unless that says otherwise (SYSREG MSS_GPIO_DEF). Context: thread.
 */
void gpio_configure_output(uint32_t pin);

/* Context: thread. */
void gpio_configure_input(uint32_t pin);

/*
 * Level of an output pin. One store through the bit-band alias, so pins written by a thread and by interrupts do not
 * disturb each other. Context: any.
 */
static inline void gpio_write(uint32_t pin, bool high)
{
    if (pin < GPIO_PINS) {
        const uint32_t out_offset = GPIO_BASE - GPIO_BIT_BAND_OF + offsetof(struct gpio_regs, GPIO_OUT);
        *REG_BLOCK(volatile uint32_t, GPIO_BIT_BAND + (out_offset << 5) + (pin << 2)) = high ? 1u : 0u;
    }
}

/* Level at the pin (of an input, or an output's own). Context: any. */
static inline bool gpio_read(uint32_t pin)
{
    return pin < GPIO_PINS && ((GPIO->GPIO_IN >> pin) & 1u) != 0u;
}

#endif
