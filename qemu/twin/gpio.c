/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "gpio.h"

#include <string.h>

enum { IRQ = 0x80, IN = 0x84, OUT = 0x88 };
enum { OUTPUT = 1, INPUT = 2, OUTPUT_BUFFER = 4, CONFIG_BITS = 0xFF };

void gpio_reset(struct gpio *g, uint32_t high_bytes)
{
    memset(g->config, 0, sizeof g->config);
    g->out = 0;
    for (unsigned byte = 0; byte < GPIO_PINS / 8; byte++) {
        g->out |= ((high_bytes >> byte) & 1u) * 0xFFu << 8 * byte;
    }
}

bool gpio_drives(const struct gpio *g, unsigned pin)
{
    const uint32_t driver = OUTPUT | OUTPUT_BUFFER;
    return (g->config[pin] & driver) == driver && ((g->out >> pin) & 1u) != 0;
}

static bool pin_high(const struct gpio *g, unsigned pin)
{
    return gpio_drives(g, pin) && (g->config[pin] & INPUT) != 0;
}

uint32_t gpio_read(void *gpio, uint32_t offset)
{
    const struct gpio *g = gpio;
    if (offset < IRQ) {
        return g->config[offset / 4];
    }
    if (offset == OUT) {
        return g->out;
    }
    uint32_t in = 0;
    for (unsigned pin = 0; offset == IN && pin < GPIO_PINS; pin++) {
        in |= (uint32_t)pin_high(g, pin) << pin;
    }
    return in;
}

void gpio_write(void *gpio, uint32_t offset, uint32_t value)
{
    struct gpio *g = gpio;
    if (offset < IRQ) {
        g->config[offset / 4] = value & CONFIG_BITS;
    } else if (offset == OUT) {
        g->out = value;
    }
}
