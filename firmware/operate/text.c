/* SPDX-License-Identifier: MIT */
#include "firmware/operate/text.h"

#include "drivers/cortex/cpu.h"
#include "firmware/operate/modbus.h"

#define PATIENCE_MS 20u /* a working transmitter makes room every 1.4 ms */

void text_serve_bus(struct text *t)
{
    if (t->bus != NULL) {
        modbus_poll(t->bus);
    }
}

/*
 * Waits for room, but no longer than a live transmitter takes. Serves the watchdog when room has come, not before: waiting is
 * no sign of life.
 */
static bool wait_for_room(struct text *t)
{
    if (mmuart_free_space(t->uart) > 0u) {
        return true;
    }
    const uint32_t since_ms = *t->idle->time_ms;
    while (mmuart_free_space(t->uart) == 0u) {
        if (t->given_up || *t->idle->time_ms - since_ms > PATIENCE_MS) {
            return false;
        }
        text_serve_bus(t);
        cpu_wait_for_interrupt();
    }
    idle_serve_watchdog(t->idle);
    return true;
}

void text_put_char(struct text *t, char c)
{
    t->given_up = !wait_for_room(t);
    if (t->given_up) {
        t->lost = true;
    } else {
        (void)mmuart_put(t->uart, c);
    }
}

void text_put(struct text *t, const char *s)
{
    for (; *s != '\0'; s++) {
        text_put_char(t, *s);
    }
}

void text_put_line(struct text *t, const char *s)
{
    text_put(t, s);
    text_put(t, "\r\n");
    text_serve_bus(t); /* to fill an empty buffer takes half a millisecond */
}

static void put_unsigned(struct text *t, uint32_t value, unsigned least_digits)
{
    char digits[10];
    unsigned n = 0;
    while (value != 0u || n < least_digits) {
        digits[n++] = (char)('0' + value % 10u);
        value /= 10u;
    }
    while (n > 0u) {
        text_put_char(t, digits[--n]);
    }
}

static uint32_t put_sign(struct text *t, int32_t value)
{
    if (value < 0) {
        text_put_char(t, '-');
        return 0u - (uint32_t)value;
    }
    return (uint32_t)value;
}

void text_put_int(struct text *t, int32_t value)
{
    put_unsigned(t, put_sign(t, value), 1);
}

void text_put_hex(struct text *t, uint32_t value)
{
    text_put(t, "0x");
    for (int shift = 28; shift >= 0; shift -= 4) {
        text_put_char(t, "0123456789abcdef"[(value >> shift) & 15u]);
    }
}

void text_put_milli(struct text *t, int32_t thousandths)
{
    const uint32_t magnitude = put_sign(t, thousandths);
    put_unsigned(t, magnitude / 1000u, 1);
    text_put_char(t, '.');
    put_unsigned(t, magnitude % 1000u, 3);
}

/* Seconds fit 32 bits for 136 years. */
void text_put_seconds(struct text *t, uint64_t ms)
{
    put_unsigned(t, (uint32_t)(ms / 1000u), 1);
    text_put_char(t, '.');
    put_unsigned(t, (uint32_t)(ms % 1000u), 3);
}

void text_put_long(struct text *t, int64_t value)
{
    char digits[20]; /* of 64 bits without a sign */
    uint64_t magnitude = value < 0 ? 0u - (uint64_t)value : (uint64_t)value;
    size_t n = 0;
    do {
        digits[n++] = (char)('0' + magnitude % 10u);
        magnitude /= 10u;
    } while (magnitude != 0u);
    if (value < 0) {
        text_put_char(t, '-');
    }
    while (n > 0u) {
        text_put_char(t, digits[--n]);
    }
}

bool text_equal(const char *a, const char *b)
{
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
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
    unsigned digits = 0;
    for (; *s != '\0' && *s != '.'; s++, digits++) {
        if (!add_digit(&magnitude, *s)) {
            return false;
        }
    }
    if (*s == '.' && decimals > 0u) {
        for (s++; *s != '\0' && decimals > 0u; s++, decimals--, digits++) {
            if (!add_digit(&magnitude, *s)) {
                return false;
            }
        }
    }
    if (*s != '\0' || digits == 0u) {
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
