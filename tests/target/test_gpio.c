/* SPDX-License-Identifier: MIT */
/* GPIO against its registers. */
#include "drivers/mss/gpio.h"
#include "tests/target/harness.h"

static void test_gpio(void)
{
    gpio_init();
    harness_true("gpio: a pin over 31 reads low", !gpio_read(GPIO_PINS));
    harness_equal("gpio: the outputs after a reset are the design's", GPIO->GPIO_OUT, 0xFFFFFF00u);
    harness_equal("gpio: no pin is driven", GPIO->GPIO_CFG[0] | GPIO->GPIO_CFG[5] | GPIO->GPIO_CFG[31], 0u);
    for (uint32_t pin = 0; pin < GPIO_PINS; pin++) {
        gpio_write(pin, false);
    }
    harness_equal("gpio: each pin can be written low before it is driven", GPIO->GPIO_OUT, 0u);
    gpio_configure_output(5u);
    gpio_configure_output(31u);
    gpio_configure_input(6u);
    gpio_write(5u, true);
    gpio_write(6u, true);
    harness_true("gpio: an output reads back high", gpio_read(5u));
    harness_true("gpio: another output stays low", !gpio_read(31u));
    harness_true("gpio: an input does not follow the output register", !gpio_read(6u));
    gpio_write(31u, true);
    gpio_write(5u, false);
    harness_true("gpio: low again, the other one high", !gpio_read(5u) && gpio_read(31u));
    gpio_write(GPIO_PINS, true);
    harness_equal("gpio: a pin over 31 writes nothing", GPIO->GPIO_OUT, (1u << 31) | (1u << 6));
}

int main(void)
{
    (void)harness_begin();
    test_gpio();
    harness_end();
}
