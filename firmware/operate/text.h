/* SPDX-License-Identifier: MIT */
/* Text to and from the console. Numbers are integers or thousandths: there is no floating point. */
#ifndef FIRMWARE_OPERATE_TEXT_H
#define FIRMWARE_OPERATE_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/mss/mmuart.h"
#include "firmware/system/idle.h"

struct modbus;
struct canopen;

struct text {
    struct mmuart *uart;
    struct idle *idle;   /* clock for timeouts, and the watchdog's service */
    struct modbus *bus;  /* served while output waits, and after each line; NULL: none */
    struct canopen *can; /* likewise */
    bool given_up;       /* timed out: do not wait again until there is room */
    bool lost;           /* output has been dropped; cleared once reported */
};

/* Format check in host builds only: on the target int32_t is long, which GCC refuses as %d. */
#ifdef __arm__
#define TEXT_CHECKED
#else
#define TEXT_CHECKED __attribute__((format(printf, 2, 3)))
#endif

/*
 * Output waits for room in the transmit buffer. After 20 ms without room the transmitter counts as dead: output is then dropped
 * without waiting, until there is room again. Thread only.
 *
 * A '\n' is sent as CR LF, and the buses are served.
 */
void text_put(struct text *t, const char *s);
void text_put_char(struct text *t, char c);

/*
 * A subset of printf: %s, %c, %d and %u, these two with ll for 64 bits; %08x, %%. After %.3 a number is in thousandths: -1234
 * is printed as -1.234.
 */
void text_print(struct text *t, const char *format, ...) TEXT_CHECKED;

/* Serves buses and watchdog: call it within work that takes longer than 1 ms, which a request may wait. Thread. */
void text_yield(struct text *t);

/*
 * Reads a whole number, or one with up to three decimals as thousandths. False, with *value untouched, unless all of `s` is a
 * number that fits.
 */
bool text_parse_int(const char *s, int32_t *value);
bool text_parse_milli(const char *s, int32_t *value);

#endif
