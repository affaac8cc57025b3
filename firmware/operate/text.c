/* SPDX-License-Identifier: MIT */
#include "firmware/operate/text.h"

#include <stdarg.h>

#include "drivers/cortex/cpu.h"
#include "firmware/operate/canopen.h"
#include "firmware/operate/messages.h"
#include "firmware/operate/modbus.h"
#include "firmware/settings/features.h"

#define STALL_MS 20u /* a working transmitter frees space every 1.4 ms */

static void serve_buses(struct text *t)
{
    if (FEATURE_IN(MODBUS) && t->bus != NULL) {
        modbus_poll(t->bus);
    }
    if (FEATURE_IN(CAN) && t->can != NULL) {
        canopen_poll(t->can);
    }
}

void text_yield(struct text *t)
{
    serve_buses(t);
    idle_serve_watchdog(t->idle);
}

/*
 * Waits for room, but no longer than a working transmitter takes. Serves the watchdog only after success: waiting is not
 * progress.
 */
static bool wait_for_room(struct text *t)
{
    if (mmuart_free_space(t->uart) > 0u) {
        return true;
    }
    const uint32_t since_ms = *t->idle->time_ms;
    while (mmuart_free_space(t->uart) == 0u) {
        if (t->given_up || *t->idle->time_ms - since_ms > STALL_MS) {
            return false;
        }
        serve_buses(t);
        cpu_wait_for_interrupt();
    }
    idle_serve_watchdog(t->idle);
    return true;
}

static void put_plain(struct text *t, char c)
{
    t->given_up = !wait_for_room(t);
    if (t->given_up) {
        t->lost = true;
    } else {
        (void)mmuart_put(t->uart, c);
    }
}

void text_put_char(struct text *t, char c)
{
    char waiting[MESSAGE_WAITING];
    uint32_t count = 0;
    for (;;) {
        while ((uint8_t)c >= MESSAGE_PAIR) {
            const char *const pair = &message_pairs[2u * ((uint8_t)c - MESSAGE_PAIR)];
            waiting[count++] = pair[1];
            c = pair[0];
        }
        put_plain(t, c);
        if (count == 0u) {
            return;
        }
        c = waiting[--count];
    }
}

static void put_or_end_line(struct text *t, char c)
{
    if (c == '\n') {
        text_put_char(t, '\r');
    }
    text_put_char(t, c);
    if (c == '\n') {
        text_yield(t); /* output that need not wait does not serve them */
    }
}

void text_put(struct text *t, const char *s)
{
    for (; *s != '\0'; s++) {
        put_or_end_line(t, *s);
    }
}

/* With a point before the last `decimals` digits. 64-bit divisions are slow: only for values that need them. */
static void put_number(struct text *t, uint64_t value, uint32_t decimals)
{
    char digits[20]; /* of 64 bits */
    uint32_t n = 0;
    for (; value > UINT32_MAX; value /= 10u) {
        digits[n++] = (char)('0' + (uint32_t)(value % 10u));
    }
    for (uint32_t rest = (uint32_t)value; rest != 0u || n <= decimals; rest /= 10u) {
        digits[n++] = (char)('0' + rest % 10u);
    }
    for (; n > 0u; n--) {
        if (n == decimals) {
            text_put_char(t, '.');
        }
        text_put_char(t, digits[n - 1u]);
    }
}

static void put_signed(struct text *t, int64_t value, uint32_t decimals)
{
    if (value < 0) {
        text_put_char(t, '-');
    }
    put_number(t, value < 0 ? 0u - (uint64_t)value : (uint64_t)value, decimals);
}

static void put_hex(struct text *t, uint32_t value)
{
    for (int shift = 28; shift >= 0; shift -= 4) {
        text_put_char(t, "0123456789abcdef"[(value >> shift) & 15u]);
    }
}

/* Prints the next argument by the conversion after '%'; returns the end of that. */
static const char *put_argument(struct text *t, const char *how, va_list *arguments)
{
    const uint32_t decimals = *how == '.' ? 3u : 0u;
    how += *how == '.' || *how == '0' ? 2 : 0; /* ".3", "08" */
    const bool wide = *how == 'l';
    how += wide ? 2 : 0;
    switch (*how) {
    case 's':
        text_put(t, va_arg(*arguments, const char *));
        break;
    case 'c':
        text_put_char(t, (char)va_arg(*arguments, int));
        break;
    case 'x':
        put_hex(t, va_arg(*arguments, uint32_t));
        break;
    case 'd':
        put_signed(t, wide ? va_arg(*arguments, int64_t) : va_arg(*arguments, int32_t), decimals);
        break;
    default: /* 'u' */
        put_number(t, wide ? va_arg(*arguments, uint64_t) : va_arg(*arguments, uint32_t), decimals);
        break;
    }
    return how + 1;
}

void text_print(struct text *t, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    while (*format != '\0') {
        if (*format == '%' && *++format != '%') {
            format = put_argument(t, format, &arguments);
        } else {
            put_or_end_line(t, *format++);
        }
    }
    va_end(arguments);
}

/* Adds a digit to a magnitude; false when it would leave 0...INT32_MAX. */
static bool add_digit(uint32_t *magnitude, char digit)
{
    const uint32_t d = (uint32_t)(digit - '0');
    if (d > 9u || *magnitude > (INT32_MAX - d) / 10u) {
        return false;
    }
    *magnitude = *magnitude * 10u + d;
    return true;
}

/* A sign, digits, and at most `decimals` more after a point; the result is scaled by 10^decimals. */
static bool parse(const char *s, unsigned decimals, int32_t *value)
{
    const bool negative = *s == '-';
    if (*s == '-' || *s == '+') {
        s++;
    }
    uint32_t magnitude = 0;
    bool point = false;
    bool any = false;
    for (; *s != '\0'; s++) {
        if (*s == '.' && !point && decimals > 0u) {
            point = true;
            continue;
        }
        if ((point && decimals == 0u) || !add_digit(&magnitude, *s)) {
            return false;
        }
        any = true;
        decimals -= point ? 1u : 0u;
    }
    if (!any) {
        return false;
    }
    for (; decimals > 0u; decimals--) {
        if (!add_digit(&magnitude, '0')) {
            return false;
        }
    }
    *value = negative ? -(int32_t)magnitude : (int32_t)magnitude;
    return true;
}

bool text_parse_int(const char *s, int32_t *value)
{
    return parse(s, 0, value);
}

bool text_parse_milli(const char *s, int32_t *value)
{
    return parse(s, 3, value);
}
