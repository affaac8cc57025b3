/* SPDX-License-Identifier: MIT */
#include "drivers/mss/gpio.h"

#include "drivers/mss/sysreg.h"

void gpio_init(void)
{
    sysreg_release_reset(SYSREG_RESET_GPIO | SYSREG_RESET_GPOUT);
}

void gpio_configure_output(uint32_t pin)
{
    if (pin < GPIO_PINS) {
        GPIO->GPIO_CFG[pin] = GPIO_CFG_OUTPUT | GPIO_CFG_OUTPUT_BUFFER | GPIO_CFG_INPUT;
    }
}

void gpio_configure_input(uint32_t pin)
{
    if (pin < GPIO_PINS) {
        GPIO->GPIO_CFG[pin] = GPIO_CFG_INPUT;
    }
}
