/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "can.h"

#include <string.h>

enum {
    INT_STATUS = 0x00,
    INT_ENABLE = 0x04,
    RX_BUF_STATUS = 0x08,
    TX_BUF_STATUS = 0x0C,
    ERROR_STATUS = 0x10,
    COMMAND = 0x14,
    CONFIG = 0x18,
    CAPTURE = 0x1C,
    TX = 0x20,
    RX = 0x220
};
enum {
    LOST_ARBITRATION = 1 << 2,
    BUS_OFF = 1 << 9,
    RX_LOST = 1 << 10,
    TX_DONE = 1 << 11,
    RX_STORED = 1 << 12,
    ONE_SHOT = 1 << 15
};
enum { RUN = 1, LISTEN_ONLY = 2, TEST_MODES = 0xF };
enum { AUTO_RESTART = 1 << 4, FIXED_ORDER = 1 << 12, SWAP = 1 << 13 };
enum {
    REQUEST = 1,
    ABORT = 2,
    TX_INTERRUPT = 4,
    WRITES_LOW = 8,
    WRITES_HIGH = 1 << 23,
    EXTENDED = 1 << 20,
    REMOTE = 1 << 21
};
enum { AVAILABLE = 1, ENABLED = 8, RX_INTERRUPT = 1 << 5, RX_WRITES_LOW = 1 << 7 };

#define ALL_STATUS   0xFFFCu
#define REVISION     0x21000000u
#define RX_LOW_BITS  0x78u
#define HIGH_BITS    0x3F0000u
#define PASSIVE_FROM 128u
#define OFF_FROM     256u
#define CLOCK_NS     10.0

void can_power_on(struct can *c)
{
    memset(c, 0x5A, sizeof *c);
    can_reset(c);
}

void can_reset(struct can *c)
{
    c->status = c->enable = c->command = c->config = c->capture = 0;
    c->requests = c->stored = c->aborts = 0;
    c->turn = c->tec = c->rec = 0;
    c->bus_off = false;
}

bool can_interrupt(const struct can *c)
{
    return (c->enable & 1u) && (c->status & c->enable & ALL_STATUS);
}

static bool runs(const struct can *c)
{
    return (c->command & RUN) != 0;
}

bool can_hears(const struct can *c)
{
    return runs(c) && !c->bus_off;
}

bool can_acknowledges(const struct can *c)
{
    return can_hears(c) && !(c->command & LISTEN_ONLY);
}

bool can_passive(const struct can *c)
{
    return c->tec >= PASSIVE_FROM || c->rec >= PASSIVE_FROM;
}

double can_bit_ns(const struct can *c)
{
    unsigned prescaler = (c->config >> 16 & 0x7FFF) + 1;
    unsigned quanta = 1 + (c->config >> 8 & 15) + 1 + (c->config >> 5 & 7) + 1;
    return CLOCK_NS * prescaler * quanta;
}

/* ---- registers ---- */

static uint32_t error_status(const struct can *c)
{
    uint32_t state = c->bus_off ? 2u : can_passive(c) ? 1u : 0u;
    uint32_t tec = c->tec > 255 ? 255 : c->tec, rec = c->rec > 255 ? 255 : c->rec;
    return tec | rec << 8 | state << 16 | (uint32_t)(c->tec >= 96) << 18 | (uint32_t)(c->rec >= 96) << 19;
}

static uint32_t *tx_word(struct can *c, uint32_t at)
{
    return &((uint32_t *)&c->tx[at / 16])[at % 16 / 4];
}

static uint32_t *rx_word(struct can *c, uint32_t at)
{
    return &((uint32_t *)&c->rx[at / 32])[at % 32 / 4];
}

/* The write-protect bits do not read back as they were written. */
static uint32_t read_tx(struct can *c, uint32_t at)
{
    unsigned n = at / 16;
    if (at % 16 != 0) {
        return *tx_word(c, at);
    }
    return c->tx[n].control | (c->requests >> n & 1u ? REQUEST : 0u) | (c->aborts >> n & 1u ? ABORT : 0u) | WRITES_LOW |
           WRITES_HIGH;
}

uint32_t can_read(struct can *c, uint32_t offset)
{
    switch (offset) {
    case INT_STATUS:
        return c->status;
    case INT_ENABLE:
        return c->enable;
    case RX_BUF_STATUS:
        return c->stored;
    case TX_BUF_STATUS:
        return c->requests;
    case ERROR_STATUS:
        return error_status(c);
    case COMMAND:
        return c->command | REVISION;
    case CONFIG:
        return c->config;
    case CAPTURE:
        return c->capture;
    default:
        break;
    }
    if (offset < RX) {
        return read_tx(c, offset - TX);
    }
    uint32_t at = offset - RX;
    return *rx_word(c, at) | (at % 32 == 0 && (c->stored >> at / 32 & 1u) ? AVAILABLE : 0u);
}

static void write_tx(struct can *c, uint32_t at, uint32_t value)
{
    unsigned n = at / 16;
    if (c->requests >> n & 1u) { /* under way: nothing of it changes but that it may be taken back */
        c->aborts |= at % 16 == 0 && (value & ABORT) ? 1u << n : 0u;
        return;
    }
    if (at % 16 != 0) {
        *tx_word(c, at) = value;
        return;
    }
    uint32_t may = (value & WRITES_LOW ? TX_INTERRUPT : 0u) | (value & WRITES_HIGH ? HIGH_BITS : 0u);
    c->tx[n].control = (c->tx[n].control & ~may & (TX_INTERRUPT | HIGH_BITS)) | (value & may);
    c->requests |= (value & REQUEST) << n;
    c->aborts |= value & REQUEST && value & ABORT ? 1u << n : 0u;
}

static void write_rx(struct can *c, uint32_t at, uint32_t value)
{
    unsigned n = at / 32;
    if (at % 32 != 0) {
        *rx_word(c, at) = value;
        return;
    }
    uint32_t may = (value & RX_WRITES_LOW ? RX_LOW_BITS : 0u) | (value & WRITES_HIGH ? HIGH_BITS : 0u);
    c->rx[n].control = (c->rx[n].control & ~may & (RX_LOW_BITS | HIGH_BITS)) | (value & may);
    c->stored &= ~((value & AVAILABLE) << n);
}

void can_write(struct can *c, uint32_t offset, uint32_t value)
{
    switch (offset) {
    case INT_STATUS:
        c->status &= ~value;
        return;
    case INT_ENABLE:
        c->enable = value & (ALL_STATUS | 1u);
        return;
    case COMMAND:
        c->command = value & TEST_MODES;
        return;
    case CONFIG:
        c->config = runs(c) ? c->config : value;
        return;
    case CAPTURE:
        c->capture = value & 1u;
        return;
    case RX_BUF_STATUS:
    case TX_BUF_STATUS:
    case ERROR_STATUS:
        return;
    default:
        break;
    }
    if (offset < RX) {
        write_tx(c, offset - TX, value);
    } else {
        write_rx(c, offset - RX, value);
    }
}

/* ---- frames ---- */

static void unpack(const struct can *c, uint32_t high, uint32_t low, uint8_t *data)
{
    for (int n = 0; n < 8; n++) {
        uint32_t word = n < 4 ? high : low;
        int shift = c->config & SWAP ? 8 * (n % 4) : 24 - 8 * (n % 4);
        data[n] = (uint8_t)(word >> shift);
    }
}

static uint32_t pack(const struct can *c, const uint8_t *data)
{
    uint32_t word = 0;
    for (int n = 0; n < 4; n++) {
        word |= (uint32_t)data[n] << (c->config & SWAP ? 8 * n : 24 - 8 * n);
    }
    return word;
}

static struct can_frame frame_of(const struct can *c, const struct can_tx *t)
{
    struct can_frame f = {.extended = t->control & EXTENDED, .remote = t->control & REMOTE};
    unsigned count = t->control >> 16 & 15;
    f.id = f.extended ? t->id >> 3 : t->id >> 21;
    f.count = (uint8_t)(count > 8 ? 8 : count);
    unpack(c, t->high, t->low, f.data);
    return f;
}

int can_offer(const struct can *c, struct can_frame *frame)
{
    if (!can_acknowledges(c)) {
        return -1;
    }
    unsigned from = c->config & FIXED_ORDER ? 0 : c->turn;
    for (unsigned n = 0; n < CAN_MAILBOXES; n++) {
        unsigned mailbox = (from + n) % CAN_MAILBOXES;
        if (c->requests >> mailbox & 1u) {
            *frame = frame_of(c, &c->tx[mailbox]);
            return (int)mailbox;
        }
    }
    return -1;
}

static void let_go(struct can *c, int mailbox)
{
    c->requests &= ~(1u << mailbox);
    c->aborts &= ~(1u << mailbox);
    c->turn = ((unsigned)mailbox + 1) % CAN_MAILBOXES;
}

void can_sent(struct can *c, int mailbox)
{
    c->tec -= c->tec > 0;
    c->status |= c->tx[mailbox].control & TX_INTERRUPT ? TX_DONE : 0u;
    let_go(c, mailbox);
}

void can_lost_arbitration(struct can *c, int mailbox)
{
    c->status |= LOST_ARBITRATION;
    if (c->aborts >> mailbox & 1u) {
        c->status |= ONE_SHOT;
        let_go(c, mailbox);
    }
}

/* A node that nobody acknowledges goes no further than error passive: it may be alone. */
void can_failed(struct can *c, int mailbox, enum can_error error)
{
    c->status |= error;
    c->tec += error == CAN_ACK_ERROR && c->tec >= PASSIVE_FROM ? 0 : 8;
    if (c->tec >= OFF_FROM) {
        c->bus_off = true;
        c->rec = 0;
        c->status |= BUS_OFF;
    }
    if (c->aborts >> mailbox & 1u) {
        c->status |= ONE_SHOT;
        let_go(c, mailbox);
    }
}

void can_heard_error(struct can *c, enum can_error error)
{
    if (can_hears(c)) {
        c->status |= error;
        c->rec += c->rec < 255;
    }
}

static bool matches(const struct can_rx *r, uint32_t word, uint32_t first_two)
{
    return ((word ^ r->code) & ~r->mask & ~1u) == 0 && ((first_two ^ r->code_data) & ~r->mask_data & 0xFFFFu) == 0;
}

static void store(struct can *c, unsigned n, const struct can_frame *f, uint32_t id)
{
    struct can_rx *r = &c->rx[n];
    r->control = (r->control & RX_LOW_BITS) | (uint32_t)f->count << 16 | (f->extended ? EXTENDED : 0u) |
                 (f->remote ? REMOTE : 0u);
    r->id = id;
    r->high = pack(c, f->data);
    r->low = pack(c, f->data + 4);
    c->stored |= 1u << n;
    c->status |= r->control & RX_INTERRUPT ? RX_STORED : 0u;
}

void can_received(struct can *c, const struct can_frame *f)
{
    if (!can_hears(c)) {
        return;
    }
    uint32_t id = f->extended ? f->id << 3 : f->id << 21, wanted = 0;
    uint32_t word = id | (f->extended ? 4u : 0u) | (f->remote ? 2u : 0u);
    uint32_t first_two = f->count > 0 && !f->remote ? (uint32_t)f->data[0] << 8 | (f->count > 1 ? f->data[1] : 0) : 0;
    c->rec -= c->rec > 0;
    for (unsigned n = 0; n < CAN_MAILBOXES; n++) {
        if ((c->rx[n].control & ENABLED) && matches(&c->rx[n], word, first_two)) {
            wanted++;
            if (!(c->stored >> n & 1u)) {
                store(c, n, f, id);
                return;
            }
        }
    }
    c->status |= wanted ? RX_LOST : 0u;
}

bool can_recovers(const struct can *c)
{
    return c->bus_off && runs(c) && (c->config & AUTO_RESTART);
}

void can_recovered(struct can *c)
{
    c->bus_off = false;
    c->tec = c->rec = 0;
}
