/* SPDX-License-Identifier: MIT */
#include "drivers/mss/rs485.h"

#include "drivers/mss/gpio.h"
#include "drivers/mss/timer.h"

#define CHARACTER_BITS 11u
#define SETTLE         2u /* characters */

bool rs485_open(struct rs485 *r, struct mmuart_regs *regs, uint32_t pin, uint32_t baud, enum mmuart_format format)
{
    gpio_init();
    gpio_write(pin, false);
    gpio_configure_output(pin);
    r->pin = pin;
    r->driving = false;
    r->whole = false;
    r->settling = false;
    r->character_ticks = CHARACTER_BITS * (BOARD_MSS_TIMER_HZ / baud + 1u);
    return mmuart_open(&r->uart, regs, baud, format);
}

void rs485_send(struct rs485 *r, const uint8_t *bytes, size_t count)
{
    r->whole = false;
    r->uart.rx_muted = true;
    r->driving = true;
    gpio_write(r->pin, true);
    for (size_t n = 0; n < count; n++) {
        (void)mmuart_put(&r->uart, (char)bytes[n]);
    }
    r->whole = true;
    mss_timer2_start_once((uint32_t)(count - 1u) * r->character_ticks); /* when the last one is on its way */
}

void rs485_uart_handler(struct rs485 *r)
{
    r->settling = false;
    mmuart_irq_handler(&r->uart);
    if (!r->driving) {
        mss_timer2_start_once(r->character_ticks * 7u / 2u);
    }
}

/* The last of an echo came before its stop bit was over. */
static void release(struct rs485 *r)
{
    gpio_write(r->pin, false);
    r->uart.rx_muted = false;
    r->uart.rx_suspects = 1u;
    r->settling = true;
    r->driving = false;
    mss_timer2_start_once(SETTLE * r->character_ticks);
}

/* Nobody has spoken since. */
static void notice_silence(struct rs485 *r)
{
    if (r->settling) {
        r->settling = false;
        r->uart.rx_suspects = 0u;
    } else {
        r->uart.rx_silence = true;
    }
}

void rs485_timer_handler(struct rs485 *r)
{
    mss_timer2_acknowledge();
    if (!r->driving) {
        notice_silence(r);
        return;
    }
    if (r->whole && mmuart_is_idle(&r->uart)) {
        release(r);
    } else {
        mss_timer2_start_once(r->character_ticks / 4u);
    }
}
