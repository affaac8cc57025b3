/* SPDX-License-Identifier: MIT */
#include "firmware/operate/text.h"

#include "drivers/mss/mmuart.h"
#include "firmware/system/idle.h"

void text_put_char(char c)
{
    while (mmuart0_free_space() == 0u) {
        idle();
    }
    (void)mmuart0_put(c);
}

void text_put(const char *s)
{
    for (; *s != '\0'; s++) {
        text_put_char(*s);
    }
}

void text_put_line(const char *s)
{
    text_put(s);
    text_put("\r\n");
}

static void put_unsigned(uint32_t value, unsigned least_digits)
{
    char digits[10];
    unsigned n = 0;
    do {
        digits[n++] = (char)('0' + value % 10u);
        value /= 10u;
    } while (value != 0u || n < least_digits);
    while (n > 0u) {
        text_put_char(digits[--n]);
    }
}

static uint32_t put_sign(int32_t value)
{
    if (value < 0) {
        text_put_char('-');
        return 0u - (uint32_t)value;
    }
    return (uint32_t)value;
}

void text_put_int(int32_t value)
{
    put_unsigned(put_sign(value), 1);
}

void text_put_hex(uint32_t value)
{
    text_put("0x");
    for (int shift = 28; shift >= 0; shift -= 4) {
        text_put_char("0123456789abcdef"[(value >> shift) & 15u]);
    }
}

void text_put_milli(int32_t thousandths)
{
    const uint32_t magnitude = put_sign(thousandths);
    put_unsigned(magnitude / 1000u, 1);
    text_put_char('.');
    put_unsigned(magnitude % 1000u, 3);
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
