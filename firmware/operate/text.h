/* SPDX-License-Identifier: MIT */
/* Text to and from the console: numbers are integers or thousandths, because there is no floating point here. */
#ifndef FIRMWARE_OPERATE_TEXT_H
#define FIRMWARE_OPERATE_TEXT_H

#include <stdbool.h>
#include <stdint.h>

/* Output waits for room in the transmit buffer, asleep, with the watchdog served. Thread only. */
void text_put(const char *s);
void text_put_char(char c);
void text_put_int(int32_t value);
void text_put_hex(uint32_t value);        /* 0x and eight digits */
void text_put_milli(int32_t thousandths); /* -1234 as -1.234 */
void text_put_line(const char *s);        /* with the line's end */

/* Whether two strings are the same. */
bool text_equal(const char *a, const char *b);

/*
 * Reads a whole number, or one with up to three decimals as thousandths. False, with *value untouched, unless all of `s` is a
 * number that fits.
 */
bool text_parse_int(const char *s, int32_t *value);
bool text_parse_milli(const char *s, int32_t *value);

#endif
