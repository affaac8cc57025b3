/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The MSS GPIO block (UG0331, GPIO chapter) with nothing connected to its pins: an enabled output is seen by the pin's own
 * input, everything else reads low. Pin interrupts are not modelled. */
#ifndef TWIN_GPIO_H
#define TWIN_GPIO_H

#include <stdbool.h>
#include <stdint.h>

#define GPIO_BASE  0x40013000u
#define GPIO_BYTES 0x8Cu
#define GPIO_PINS  32

struct gpio {
    uint32_t config[GPIO_PINS];
    uint32_t out;
};

/* All pins free; a bit of MSS_GPIO_DEF says how a byte of the output register begins. */
void gpio_reset(struct gpio *g, uint32_t high_bytes);

/* Whether the device drives this pin high. */
bool gpio_drives(const struct gpio *g, unsigned pin);

uint32_t gpio_read(void *gpio, uint32_t offset);
void gpio_write(void *gpio, uint32_t offset, uint32_t value);

#endif
