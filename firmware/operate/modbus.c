/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus.h"

#include "drivers/board.h"
#include "firmware/axis/axis.h"
#include "firmware/settings/crc.h"

/* ==== frames ==== */

#define FRAME_MIN     4u /* address, function, check sum */
#define EXCEPTION_BIT 0x80u

/* A length that depends on a byte not yet received, and an unknown length. */
#define LATER   0u
#define UNKNOWN SIZE_MAX

/* ---- lengths, check sum included (MODBUS Application Protocol V1.1b3, chapter 6) ---- */

/* The received bytes, or a part of them. */
struct span {
    const uint8_t *bytes;
    size_t count;
    size_t tried; /* of these, examined */
};

/* `least` bytes, and as many more as byte `counted_at` says, if that is not 0. */
struct frame_length {
    uint8_t least, counted_at;
};

/* clang-format off */
static const struct frame_lengths {
    uint8_t function;
    struct frame_length request, reply; /* reply of 0 bytes: reply_length() knows */
} frame_lengths[] = {
    {0x01, {8, 0}, {5, 2}},   {0x02, {8, 0}, {5, 2}},   {0x03, {8, 0}, {5, 2}},   {0x04, {8, 0}, {5, 2}},
    {0x05, {8, 0}, {8, 0}},   {0x06, {8, 0}, {8, 0}},   {0x07, {4, 0}, {5, 0}},   {0x08, {8, 0}, {8, 0}},
    {0x0B, {4, 0}, {8, 0}},   {0x0C, {4, 0}, {5, 2}},   {0x0F, {9, 6}, {8, 0}},   {0x10, {9, 6}, {8, 0}},
    {0x11, {4, 0}, {5, 2}},   {0x14, {5, 2}, {5, 2}},   {0x15, {5, 2}, {5, 2}},   {0x16, {10, 0}, {10, 0}},
    {0x17, {13, 10}, {5, 2}}, {0x18, {6, 0}, {0, 0}},   {0x2B, {7, 0}, {0, 0}},
};
/* clang-format on */

static const struct frame_lengths *find_lengths(uint8_t function)
{
    for (size_t n = 0; n < sizeof frame_lengths / sizeof frame_lengths[0]; n++) {
        if (frame_lengths[n].function == function) {
            return &frame_lengths[n];
        }
    }
    return NULL;
}

static size_t by_count(const struct span *f, const struct frame_length *l)
{
    if (l->counted_at == 0u) {
        return l->least;
    }
    return f->count > l->counted_at ? l->least + (size_t)f->bytes[l->counted_at] : LATER;
}

static size_t request_length(const struct span *f)
{
    const struct frame_lengths *const known = find_lengths(f->bytes[1]);
    return known == NULL ? UNKNOWN : by_count(f, &known->request);
}

/* Each object of an identification has a number and a length; byte 7 says how many there are. */
static size_t identification_length(const struct span *f)
{
    if (f->count < 8u) {
        return LATER;
    }
    size_t end = 8;
    for (uint32_t object = 0; object < f->bytes[7]; object++) {
        if (f->count < end + 2u) {
            return LATER;
        }
        end += 2u + f->bytes[end + 1u];
    }
    return end + CRC16_BYTES;
}

static size_t reply_length(const struct span *f)
{
    const uint8_t function = f->bytes[1];
    if ((function & EXCEPTION_BIT) != 0u) {
        return 5;
    }
    if (function == 0x18u) {
        return f->count > 3u ? 6u + 256u * f->bytes[2] + f->bytes[3] : LATER;
    }
    if (function == 0x2Bu) {
        return identification_length(f);
    }
    const struct frame_lengths *const known = find_lengths(function);
    return known == NULL ? UNKNOWN : by_count(f, &known->reply);
}

/* ---- reading ---- */

/* Each length is tried once, when its last byte has come: a check sum per byte would take longer than the byte. */
static bool frame_fits(const struct span *f, size_t length)
{
    return length > f->tried && length >= FRAME_MIN && length <= f->count && crc16(f->bytes, length) == 0u;
}

/* True if more bytes may yet complete a frame of this length. */
static bool may_come(const struct span *f, size_t length)
{
    return length == LATER || (length != UNKNOWN && length <= MODBUS_FRAME_BYTES && length > f->count);
}

void modbus_frame_forget(struct modbus_frame *f)
{
    f->count = 0;
    f->silence = 0;
    f->tried = 0;
    f->lost = false;
    f->open = false;
    f->resumed = false;
}

/* Removes `length` bytes from the beginning. */
static void modbus_frame_drop(struct modbus_frame *f, size_t length)
{
    f->count -= length;
    for (size_t n = 0; n < f->count; n++) {
        f->bytes[n] = f->bytes[n + length];
    }
    f->silence = f->silence > length ? f->silence - length : 0u;
    f->tried = 0;
    f->resumed = f->resumed && f->count > 0u;
}

/* Resumes after the silence. The positions of later ones are not kept. */
static void resume(struct modbus_frame *f)
{
    modbus_frame_drop(f, f->silence);
    f->silence = 0;
    f->lost = false;
    f->resumed = true;
}

/* A silence of 3.5 characters or more. */
static void modbus_frame_silence(struct modbus_frame *f)
{
    if (f->lost || f->open) {
        modbus_frame_forget(f);
        f->resumed = true;
    } else if (f->silence == 0u) {
        f->silence = f->count;
    }
}

static void modbus_frame_receive(struct modbus_frame *f, uint8_t byte)
{
    if (f->count == MODBUS_FRAME_BYTES) {
        modbus_frame_forget(f);
        f->lost = true;
    }
    if (!f->lost) {
        f->bytes[f->count++] = byte;
    }
}

/* An address that this drive answers under: one for each axis. */
static bool is_own(uint8_t to, uint8_t address)
{
    return to >= address && to - address < (int)AXIS_COUNT && to <= MODBUS_ADDRESS_MAX;
}

/* Length of a frame at the beginning, or 0; *impossible: more bytes cannot complete one. */
static size_t frame_in(const struct span *f, uint8_t address, bool *impossible)
{
    *impossible = false;
    if (f->count < 2u) {
        return 0;
    }
    const bool of_others = !is_own(f->bytes[0], address) && f->bytes[0] != MODBUS_BROADCAST;
    const size_t asked = request_length(f);
    const size_t answered = of_others ? reply_length(f) : asked;
    if (frame_fits(f, asked)) {
        return asked;
    }
    if (frame_fits(f, answered)) {
        return answered;
    }
    *impossible = !may_come(f, asked) && !may_come(f, answered);
    return 0;
}

static struct span span_from(const struct modbus_frame *f, size_t at)
{
    return (struct span){&f->bytes[at], f->count - at, f->tried > at ? f->tried - at : 0u};
}

static size_t frame_here(const struct modbus_frame *f, uint8_t address, bool *impossible)
{
    const struct span all = span_from(f, 0);
    return frame_in(&all, address, impossible);
}

/* A request to this drive broke off, and a complete one follows the silence: the client has started over. */
static bool has_restarted(const struct modbus_frame *f, uint8_t address)
{
    bool impossible;
    const struct span rest = span_from(f, f->silence);
    return f->silence > 0u && is_own(f->bytes[0], address) && rest.count > 0u && is_own(rest.bytes[0], address) &&
           frame_in(&rest, address, &impossible) > 0u;
}

/*
 * The length of a complete frame at the beginning of `bytes`, check sum included; 0 if there is none. `address`: the first of
 * AXIS_COUNT whose requests are searched for, which decides the possible lengths. The caller removes it by modbus_frame_drop().
 */
static size_t modbus_frame_find(struct modbus_frame *f, uint8_t address)
{
    bool impossible;
    size_t length = frame_here(f, address, &impossible);
    while ((impossible && f->silence > 0u) || (length == 0u && has_restarted(f, address))) {
        resume(f);
        length = frame_here(f, address, &impossible);
    }
    const struct span all = span_from(f, 0);
    f->open = impossible && is_own(f->bytes[0], address) && request_length(&all) == UNKNOWN;
    f->lost = impossible && !f->open;
    f->tried = f->count;
    return length;
}

/* At a silence, before modbus_frame_silence(): the length of the unknown function's request that it ends, or 0. */
static size_t modbus_frame_find_open(const struct modbus_frame *f)
{
    const struct span all = {f->bytes, f->count, 0};
    return f->open && frame_fits(&all, f->count) ? f->count : 0u;
}

/* True if a frame of this length is too old to be carried out. */
static bool modbus_frame_is_late(const struct modbus_frame *f, size_t length)
{
    return f->resumed && f->count > length;
}

/* ==== the line ==== */

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
    cia402_poll(&d->cia402, d->axis); /* before the next control word replaces this one */
}

/* Handles the frame at the start of the received bytes: carries it out if addressed to this drive and in time. */
static void take_frame(struct modbus *m, size_t length)
{
    const uint8_t to = m->frame.bytes[0];
    const bool accepts = m->address != 0 && !rs485_is_sending(m->line) && !modbus_frame_is_late(&m->frame, length);
    for (uint32_t n = 0; accepts && n < AXIS_COUNT; n++) {
        const uint32_t own = (uint32_t)m->address + n;
        if (to == MODBUS_BROADCAST || (to == own && own <= MODBUS_ADDRESS_MAX)) {
            carry_out(m, &m->drives[n], length);
        }
    }
    modbus_frame_drop(&m->frame, length);
}

static void receive_byte(struct modbus *m, uint32_t received)
{
    if ((received & MMUART_RX_SILENCE) != 0u) {
        modbus_frame_silence(&m->frame);
    }
    if ((received & MMUART_RX_LOSS) != 0u) {
        modbus_frame_forget(&m->frame);
        m->frame.lost = true;
    }
    modbus_frame_receive(&m->frame, (uint8_t)received);
    size_t length;
    while ((length = modbus_frame_find(&m->frame, (uint8_t)m->address)) > 0u) {
        take_frame(m, length);
    }
}

/* Ends a request of an unknown function, and drops one that broke off. The slow loop's clock is exact enough. */
static void check_silence(struct modbus *m, uint32_t silent_ms)
{
    const size_t length = silent_ms >= m->silence_ms ? modbus_frame_find_open(&m->frame) : 0u;
    if (length > 0u) {
        take_frame(m, length);
    }
    if (silent_ms >= MODBUS_FRAME_TIMEOUT_MS) {
        modbus_frame_forget(&m->frame);
    }
}

/* Received bytes first: a delayed thread must not take its own delay for a silence. */
static void receive_bytes(struct modbus *m)
{
    const uint32_t now_ms = m->drives[0].axis->time_ms;
    uint32_t received;
    while (mmuart_take(&m->line->uart, &received)) {
        m->received_ms = now_ms;
        receive_byte(m, received);
    }
    check_silence(m, now_ms - m->received_ms);
}

void modbus_poll(struct modbus *m)
{
    if (!rs485_is_sending(m->line)) {
        follow_parameters(m);
    }
    receive_bytes(m);
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        cia402_poll(&m->drives[n].cia402, m->drives[n].axis);
    }
}
