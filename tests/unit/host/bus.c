/* SPDX-License-Identifier: MIT */
#include "bus.h"

uint8_t host_bus_heard[4096], host_bus_sent[4096];
uint32_t host_bus_heard_bytes, host_bus_heard_taken, host_bus_sent_bytes;
uint32_t host_bus_marks, host_bus_opened, host_bus_baud, host_bus_format;

const uint32_t host_bus_silence_mark = MMUART_RX_SILENCE, host_bus_loss_mark = MMUART_RX_LOSS;

static const struct rs485 *line;

bool host_bus_is(const struct mmuart *u)
{
    return line != NULL && u == &line->uart;
}

bool mmuart_take(struct mmuart *u, uint32_t *received)
{
    if (host_bus_is(u) && line->driving) {
        host_bus_heard_taken = host_bus_heard_bytes; /* the driver hears nothing while it sends */
    }
    if (!host_bus_is(u) || host_bus_heard_taken == host_bus_heard_bytes) {
        return false;
    }
    *received = host_bus_heard[host_bus_heard_taken++] | host_bus_marks;
    host_bus_marks = 0;
    return true;
}

bool rs485_open(struct rs485 *r, struct mmuart_regs *regs, uint32_t pin, uint32_t baud, enum mmuart_format format)
{
    (void)regs;
    (void)pin;
    line = r;
    r->driving = false;
    host_bus_opened++;
    host_bus_baud = baud;
    host_bus_format = (uint32_t)format;
    return true;
}

/* It drives until the test says otherwise. */
void rs485_send(struct rs485 *r, const uint8_t *bytes, size_t count)
{
    r->driving = true;
    for (size_t n = 0; n < count && host_bus_sent_bytes < sizeof host_bus_sent; n++) {
        host_bus_sent[host_bus_sent_bytes++] = bytes[n];
    }
}
