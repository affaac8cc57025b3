/* SPDX-License-Identifier: MIT */
/* Text to and from the console: numbers are integers or thousandths, because there is no floating point here. */
#ifndef FIRMWARE_OPERATE_TEXT_H
#define FIRMWARE_OPERATE_TEXT_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/mss/mmuart.h"
#include "firmware/system/idle.h"

struct modbus;

struct text {
    struct mmuart *uart;
    struct idle *idle;  /* its clock for waiting, and the watchdog's service */
    struct modbus *bus; /* served while output waits, and after each line; NULL: none */
    bool given_up;      /* no room for too long: do not wait until there is some */
    bool lost;          /* output has been dropped; cleared once reported */
};

/*
 * Output sleeps until there is room in the transmit buffer. After 20 ms without room the transmitter counts as dead: from then
 * on output is dropped without waiting, until there is room again. Thread only.
 */
void text_put(struct text *t, const char *s);
void text_put_char(struct text *t, char c);
void text_put_int(struct text *t, int32_t value);
void text_put_hex(struct text *t, uint32_t value);        /* 0x and eight digits */
void text_put_milli(struct text *t, int32_t thousandths); /* -1234 as -1.234 */
void text_put_long(struct text *t, int64_t value);
void text_put_seconds(struct text *t, uint64_t ms); /* 4294967296 as 4294967.296 */
void text_put_line(struct text *t, const char *s);  /* with a line end */

/* Serves the bus, for a command that takes longer than a request may wait: 1 ms. Thread. */
void text_serve_bus(struct text *t);

/* True if two strings are equal. */
bool text_equal(const char *a, const char *b);

/*
 * Reads a whole number, or one with up to three decimals as thousandths. False, with *value untouched, unless all of `s` is a
 * number that fits.
 */
bool text_parse_int(const char *s, int32_t *value);
bool text_parse_milli(const char *s, int32_t *value);

#endif
