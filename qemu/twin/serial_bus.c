/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "serial_bus.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "qemu_api.h"

enum {
    DATA = 0x00,
    IER = 0x04,
    IIR = 0x08,
    LCR = 0x0C,
    MCR = 0x10,
    LSR = 0x14,
    MSR = 0x18,
    SCRATCH = 0x1C,
    DFR = 0x3C
};
enum { IER_RECEIVED = 1, IER_EMPTY = 2, IER_ERROR = 4, LCR_STOP = 4, LCR_PARITY = 8, LCR_DIVISOR = 0x80 };
enum {
    LSR_DATA = 1,
    LSR_OVERRUN = 2,
    LSR_THR_EMPTY = 0x20,
    LSR_ALL_EMPTY = 0x40,
    FCR_CLEAR_RX = 2,
    FCR_CLEAR_TX = 4,
    MCR_LOOP = 0x10
};

#define UART_IRQ   11
#define PCLK_HZ    100000000.0
#define FIFO_BYTES 16
#define WIRE_BYTES 65536u

struct fifo {
    uint8_t bytes[FIFO_BYTES];
    unsigned count;
};

static struct {
    uint32_t word[SERIAL_BUS_BYTES / 4]; /* registers that are no more than storage */
    uint32_t divisor_low, divisor_high;
    struct fifo rx, tx;
    bool overrun, empty_pending;
    bool sending, driven; /* a character is on its way out, and was driven so far */
    uint8_t shift;
} uart;

static bool drives;
static uint8_t wire[WIRE_BYTES]; /* what others have yet to send */
static unsigned wire_from, wire_to;
static bool wire_busy;
static bool at_device;  /* who sends them is a program at the character device */
static int64_t said_ns; /* when the drive let go of the line */
static struct vm_timer *sent_timer, *heard_timer;
static struct vm_chardev *device;
static FILE *log_file;

static void note(const char *what, int byte)
{
    if (log_file && byte >= 0) {
        fprintf(log_file, "%lld %s %02x\n", (long long)vm_now_ns(), what, (unsigned)byte);
    } else if (log_file) {
        fprintf(log_file, "%lld %s\n", (long long)vm_now_ns(), what);
    }
}

static int64_t character_ns(void)
{
    double divisor = uart.divisor_high * 256.0 + uart.divisor_low + (uart.word[DFR / 4] & 63) / 64.0;
    unsigned bits = 10 + !!(uart.word[LCR / 4] & LCR_STOP) + !!(uart.word[LCR / 4] & LCR_PARITY);
    return (int64_t)(1e9 * 16 * (divisor < 1 ? 1 : divisor) * bits / PCLK_HZ);
}

static void update_interrupt(void)
{
    uint32_t enabled = uart.word[IER / 4];
    bool wanted = ((enabled & IER_RECEIVED) && uart.rx.count) || ((enabled & IER_ERROR) && uart.overrun) ||
                  ((enabled & IER_EMPTY) && uart.empty_pending);
    vm_set_interrupt(UART_IRQ, wanted);
}

static uint8_t take(struct fifo *f)
{
    uint8_t byte = f->bytes[0];
    memmove(f->bytes, f->bytes + 1, --f->count);
    return byte;
}

/* ---- in: who sends ---- */

/* A program lives in another time than the line. So it is the line that keeps the 3.5 characters of silence for it that
 * a master keeps behind a reply. */
static void begin_hearing(void)
{
    if (wire_busy || wire_from == wire_to || (at_device && drives)) {
        return;
    }
    int64_t now_ns = vm_now_ns(), quiet_ns = at_device ? said_ns + character_ns() * 7 / 2 : 0;
    wire_busy = true;
    vm_timer_at(heard_timer, (now_ns > quiet_ns ? now_ns : quiet_ns) + character_ns());
}

static void receive(uint8_t byte)
{
    if (uart.rx.count == FIFO_BYTES) {
        uart.overrun = true;
    } else {
        uart.rx.bytes[uart.rx.count++] = byte;
    }
}

/* ---- out ---- */

static void begin_character(void)
{
    if (uart.sending || !uart.tx.count) {
        return;
    }
    uart.shift = take(&uart.tx);
    uart.sending = true;
    uart.driven = drives;
    uart.empty_pending = uart.empty_pending || !uart.tx.count;
    vm_timer_at(sent_timer, vm_now_ns() + character_ns());
}

static void character_sent(void *unused)
{
    (void)unused;
    uart.sending = false;
    if (uart.word[MCR / 4] & MCR_LOOP) {
        receive(uart.shift);
        begin_character();
        update_interrupt();
        return;
    }
    note(uart.driven ? "tx" : "unheard", uart.shift);
    if (uart.driven && device) {
        vm_chardev_send(device, &uart.shift, 1);
    }
    begin_character();
    update_interrupt();
}

static void transmit(uint8_t byte)
{
    uart.empty_pending = false;
    if (uart.tx.count < FIFO_BYTES) {
        uart.tx.bytes[uart.tx.count++] = byte;
    }
    begin_character();
}

void serial_bus_drive(bool on)
{
    if (on == drives) {
        return;
    }
    drives = on;
    uart.driven = uart.driven && on;
    note(on ? "on" : "off", -1);
    if (!on) {
        said_ns = vm_now_ns();
        begin_hearing();
    }
}

/* ---- in: who hears ---- */

static void character_heard(void *unused)
{
    (void)unused;
    uint8_t byte = wire[wire_from++ % WIRE_BYTES];
    wire_busy = false;
    note(drives ? "deaf" : "rx", byte);
    if (!drives) {
        receive(byte);
    }
    begin_hearing();
    update_interrupt();
}

static int room(void *unused)
{
    (void)unused;
    return (int)(WIRE_BYTES - (wire_to - wire_from));
}

static void put_on_wire(const uint8_t *bytes, int count)
{
    for (int n = 0; n < count && room(NULL) > 0; n++) {
        wire[wire_to++ % WIRE_BYTES] = bytes[n];
    }
    begin_hearing();
}

static void device_sends(void *unused, const uint8_t *bytes, int count)
{
    (void)unused;
    at_device = true;
    put_on_wire(bytes, count);
}

void serial_bus_send(const char *hex)
{
    unsigned byte;
    int digits;
    for (; sscanf(hex, "%2x%n", &byte, &digits) == 1 && digits == 2; hex += digits) {
        uint8_t one = (uint8_t)byte;
        at_device = false;
        put_on_wire(&one, 1);
    }
    if (*hex != '\0') {
        fprintf(stderr, "mssfoc twin: bus: '%s' are no bytes in hexadecimal\n", hex);
        exit(1);
    }
}

/* ---- registers ---- */

static uint32_t line_status(void)
{
    uint32_t status = (uart.rx.count ? LSR_DATA : 0u) | (uart.overrun ? LSR_OVERRUN : 0u) |
                      (uart.tx.count ? 0u : LSR_THR_EMPTY) | (uart.tx.count || uart.sending ? 0u : LSR_ALL_EMPTY);
    uart.overrun = false;
    return status;
}

static uint32_t interrupt_identity(void)
{
    if (uart.overrun) {
        return 0xC6;
    }
    if (uart.rx.count) {
        return 0xC4;
    }
    bool empty = uart.empty_pending && (uart.word[IER / 4] & IER_EMPTY);
    uart.empty_pending = uart.empty_pending && !empty;
    return empty ? 0xC2 : 0xC1;
}

static uint32_t read_register(uint32_t offset)
{
    bool divisor = uart.word[LCR / 4] & LCR_DIVISOR;
    switch (offset) {
    case DATA:
        return divisor ? uart.divisor_low : uart.rx.count ? take(&uart.rx) : 0;
    case IER:
        return divisor ? uart.divisor_high : uart.word[IER / 4];
    case IIR:
        return interrupt_identity();
    case LSR:
        return line_status();
    case MSR:
        return 0;
    default:
        return uart.word[offset / 4];
    }
}

static void write_register(uint32_t offset, uint32_t value)
{
    bool divisor = uart.word[LCR / 4] & LCR_DIVISOR;
    if (offset == DATA && divisor) {
        uart.divisor_low = value;
    } else if (offset == DATA) {
        transmit((uint8_t)value);
    } else if (offset == IER && divisor) {
        uart.divisor_high = value;
    } else if (offset == IER) {
        bool switched_on = value & ~uart.word[IER / 4] & IER_EMPTY;
        uart.word[IER / 4] = value & 15;
        uart.empty_pending = uart.empty_pending || (switched_on && !uart.tx.count);
    } else if (offset == IIR) {
        uart.rx.count = value & FCR_CLEAR_RX ? 0 : uart.rx.count;
        uart.tx.count = value & FCR_CLEAR_TX ? 0 : uart.tx.count;
    } else if (offset != LSR && offset != MSR) {
        uart.word[offset / 4] = value;
    }
}

uint32_t serial_bus_read(void *unused, uint32_t offset)
{
    (void)unused;
    uint32_t value = read_register(offset);
    update_interrupt();
    return value;
}

void serial_bus_write(void *unused, uint32_t offset, uint32_t value)
{
    (void)unused;
    write_register(offset, value & 0xFF); /* eight bits wide on the APB */
    update_interrupt();
}

/* ---- opening, ending ---- */

void serial_bus_open(const char *chardev_id, const char *log_path)
{
    sent_timer = vm_timer_new(character_sent, NULL);
    heard_timer = vm_timer_new(character_heard, NULL);
    if (log_path && !(log_file = fopen(log_path, "w"))) {
        fprintf(stderr, "mssfoc twin: bus_log %s: %s\n", log_path, strerror(errno));
        exit(1);
    }
    if (chardev_id && !(device = vm_chardev_open(chardev_id, room, device_sends, NULL))) {
        fprintf(stderr, "mssfoc twin: QEMU has no character device '%s'\n", chardev_id);
        exit(1);
    }
}

void serial_bus_reset(void)
{
    memset(&uart, 0, sizeof uart);
    vm_timer_stop(sent_timer);
    serial_bus_drive(false);
    update_interrupt();
}

void serial_bus_flush(void)
{
    if (log_file) {
        fflush(log_file);
    }
}
