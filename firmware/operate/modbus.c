/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus.h"

#include "drivers/board.h"
#include "firmware/settings/crc.h"

#define CHARACTER_BITS 11

/* 3.5 characters, at least 1.75 ms; one more, because the clock may tick just after a character. */
static uint32_t silence_ms(int32_t baud)
{
    const int32_t ms = (CHARACTER_BITS * 3500 + baud - 1) / baud;
    return (uint32_t)(ms < 2 ? 2 : ms) + 1u;
}

static void open_line(struct modbus *m)
{
    static const enum mmuart_format formats[] = {MMUART_8N2, MMUART_8O1, MMUART_8E1}; /* 11 bits: the standard */
    const struct params *const p = &m->drives[0].axis->params;
    m->address = p->modbus_address;
    m->baud = p->modbus_baud;
    m->parity = p->modbus_parity;
    m->silence_ms = silence_ms(m->baud);
    modbus_frame_forget(&m->frame);
    (void)rs485_open(m->line, MMUART1, BOARD_PIN_BUS_DRIVER, (uint32_t)m->baud,
                     formats[m->parity]); /* the range fits */
}

void modbus_start(struct modbus *m, struct rs485 *line, struct axis *axes, const struct slots *slots)
{
    *m = (struct modbus){.line = line};
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        m->drives[n].axis = &axes[n];
        m->drives[n].slots = &slots[n];
        cia402_init(&m->drives[n].cia402, OWNER_MODBUS);
    }
    open_line(m);
}

static void follow_parameters(struct modbus *m)
{
    const struct params *const p = &m->drives[0].axis->params;
    if (p->modbus_address != m->address || p->modbus_baud != m->baud || p->modbus_parity != m->parity) {
        for (uint32_t n = 0; n < AXIS_COUNT; n++) {
            owner_leave(m->drives[n].axis, OWNER_MODBUS);
        }
        open_line(m);
    }
}

static void send_reply(struct modbus *m, uint8_t from, size_t count)
{
    m->reply[0] = from;
    const uint16_t crc = crc16(m->reply, count + 1u);
    m->reply[count + 1u] = (uint8_t)crc;
    m->reply[count + 2u] = (uint8_t)(crc >> 8);
    rs485_send(m->line, m->reply, count + 3u);
}

static void carry_out(struct modbus *m, struct bus_drive *d, size_t length)
{
    const uint8_t to = m->frame.bytes[0];
    const bool broadcast = to == MODBUS_BROADCAST;
    const size_t count = length - 1u - CRC16_BYTES;
    owner_message(d->axis, OWNER_MODBUS);
    const size_t replied = modbus_function(d, &m->frame.bytes[1], count, broadcast, &m->reply[1]);
    if (!broadcast) {
        send_reply(m, to, replied);
    }
    cia402_poll(&d->cia402, d->axis); /* before the next word takes its place */
}

/* Handles a frame at the start of the received bytes: carries it out if it is for this drive and in time. */
static void take_frame(struct modbus *m, size_t length)
{
    const uint8_t to = m->frame.bytes[0];
    const bool hears = m->address != 0 && !rs485_is_sending(m->line) && !modbus_frame_is_late(&m->frame, length);
    for (uint32_t n = 0; hears && n < AXIS_COUNT; n++) {
        const uint32_t own = (uint32_t)m->address + n;
        if (to == MODBUS_BROADCAST || (to == own && own <= MODBUS_ADDRESS_MOST)) {
            carry_out(m, &m->drives[n], length);
        }
    }
    modbus_frame_drop(&m->frame, length);
}

static void hear(struct modbus *m, uint32_t received)
{
    if ((received & MMUART_RX_SILENCE) != 0u) {
        modbus_frame_silence(&m->frame);
    }
    if ((received & MMUART_RX_LOSS) != 0u) {
        modbus_frame_forget(&m->frame);
        m->frame.lost = true;
    }
    modbus_frame_hear(&m->frame, (uint8_t)received);
    size_t length;
    while ((length = modbus_frame_find(&m->frame, (uint8_t)m->address)) > 0u) {
        take_frame(m, length);
    }
}

/* A request of an unknown function has ended, or any has been left off. By the slow loop's clock, which is enough for that. */
static void notice_silence(struct modbus *m, uint32_t silent_ms)
{
    const size_t length = silent_ms >= m->silence_ms ? modbus_frame_find_open(&m->frame) : 0u;
    if (length > 0u) {
        take_frame(m, length);
    }
    if (silent_ms >= MODBUS_PATIENCE_MS) {
        modbus_frame_forget(&m->frame);
    }
}

/* Received bytes first: a delayed thread must not take its own absence for a silence. */
static void listen(struct modbus *m)
{
    const uint32_t now_ms = m->drives[0].axis->time_ms;
    uint32_t received;
    while (mmuart_take(&m->line->uart, &received)) {
        m->heard_ms = now_ms;
        hear(m, received);
    }
    notice_silence(m, now_ms - m->heard_ms);
}

void modbus_poll(struct modbus *m)
{
    if (!rs485_is_sending(m->line)) {
        follow_parameters(m);
    }
    listen(m);
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        cia402_poll(&m->drives[n].cia402, m->drives[n].axis);
    }
}
