/* SPDX-License-Identifier: MIT */
/*
 * Frames for the storms on the bus: noise, torn and mutated requests, traffic of others with requests inside, and requests
 * that are right.
 */
#ifndef STORM_FRAMES_H
#define STORM_FRAMES_H

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "storm_random.h"

#define US         1
#define BYTES_MOST 600

static uint32_t check_sum(const uint8_t *bytes, size_t count)
{
    uint32_t value = 0xFFFF;
    for (size_t n = 0; n < count; n++) {
        value ^= bytes[n];
        for (int bit = 0; bit < 8; bit++) {
            value = (value >> 1) ^ ((value & 1u) != 0u ? 0xA001u : 0u);
        }
    }
    return value;
}

static bool fits(const uint8_t *bytes, size_t count)
{
    return count >= 4u && check_sum(bytes, count - 2u) == (uint32_t)(bytes[count - 2u] | bytes[count - 1u] << 8);
}

static size_t close_frame(uint8_t *bytes, size_t count)
{
    const uint32_t sum = check_sum(bytes, count);
    bytes[count] = (uint8_t)sum;
    bytes[count + 1u] = (uint8_t)(sum >> 8);
    return count + 2u;
}

/* ---- what is sent ---- */

static uint32_t some_register(void)
{
    static const uint16_t starts[] = {0,  1,   2,   4,     6,     7,      8,      16,     18,    43,
                                      64, 128, 192, 0x400, 0x408, 0x1000, 0x1002, 0x1020, 0x1060};
    return any(8) == 0u ? any(65536) : starts[any(sizeof starts / sizeof starts[0])] + (any(3) == 0u ? any(8) : 0u);
}

static void put_word(uint8_t *bytes, uint32_t value)
{
    bytes[0] = (uint8_t)(value >> 8);
    bytes[1] = (uint8_t)value;
}

static void fill(uint8_t *bytes, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        bytes[n] = any(2) != 0u ? (uint8_t)any(256) : 0u;
    }
}

/* A request of one of the functions that there are, to `unit`. */
static size_t request(uint8_t *bytes, uint8_t unit)
{
    static const uint8_t functions[] = {3, 4, 6, 16, 22, 23, 0x2B};
    const uint8_t function = functions[any(sizeof functions)];
    const uint32_t count = 1u + any(any(4) == 0u ? 123 : 8);
    bytes[0] = unit;
    bytes[1] = function;
    put_word(&bytes[2], some_register());
    put_word(&bytes[4], any(16) == 0u ? any(65536) : count);
    switch (function) {
    case 6:
        put_word(&bytes[4], any(65536));
        return close_frame(bytes, 6);
    case 16:
        put_word(&bytes[4], count);
        bytes[6] = (uint8_t)(2u * count);
        fill(&bytes[7], 2u * count);
        return close_frame(bytes, 7u + 2u * count);
    case 22:
        fill(&bytes[4], 4);
        return close_frame(bytes, 8);
    case 23: {
        const uint32_t writes = count < 118u ? count : 118u;
        put_word(&bytes[4], 1u + any(8));
        put_word(&bytes[6], some_register());
        put_word(&bytes[8], writes);
        bytes[10] = (uint8_t)(2u * writes);
        fill(&bytes[11], 2u * writes);
        return close_frame(bytes, 11u + 2u * writes);
    }
    case 0x2B:
        bytes[2] = 14;
        bytes[3] = (uint8_t)any(6);
        bytes[4] = (uint8_t)any(9);
        return close_frame(bytes, 5);
    default:
        return close_frame(bytes, 6);
    }
}

/* What another slave answers: a whole request to this drive may be inside. */
static size_t foreign_reply(uint8_t *bytes)
{
    uint8_t inside[BYTES_MOST];
    size_t count = request(inside, (uint8_t)(any(3) == 0u ? 0u : US));
    count = count > 240u ? 240u : count;
    const size_t lead = any(8);
    bytes[0] = (uint8_t)(2u + any(200));
    bytes[1] = (uint8_t)(3u + any(2));
    bytes[2] = (uint8_t)(lead + count);
    fill(&bytes[3], lead);
    memcpy(&bytes[3u + lead], inside, count);
    return close_frame(bytes, 3u + lead + count);
}

static size_t mutate_frame(uint8_t *bytes, size_t count)
{
    switch (any(4)) {
    case 0: /* torn */
        return any((uint32_t)count);
    case 1: /* a byte more */
        bytes[count] = (uint8_t)any(256);
        return count + 1u;
    case 2: /* a byte missing */ {
        const size_t at = any((uint32_t)count);
        memmove(&bytes[at], &bytes[at + 1u], count - at - 1u);
        return count - 1u;
    }
    default:
        for (uint32_t bits = 1u + any(5); bits > 0u; bits--) {
            bytes[any((uint32_t)count)] ^= (uint8_t)(1u << any(8));
        }
        return count;
    }
}

enum frame_kind { FRAME_RIGHT, FRAME_MUTATED, FRAME_FOREIGN, FRAME_NOISE };

/*
 * Something to send. A check sum of 16 bits fits by chance once in 65536: then a mutated frame or noise is a request like
 * others, and a part of another slave's frame looks like a frame. Such are not to be sent: *chance.
 */
static enum frame_kind some_frame(uint8_t *bytes, size_t *count, bool *chance)
{
    *count = request(bytes, (uint8_t)(any(4) == 0u ? 0u : US));
    const enum frame_kind kind = (enum frame_kind)any(4);
    if (kind == FRAME_MUTATED) {
        *count = mutate_frame(bytes, *count);
    } else if (kind == FRAME_FOREIGN) {
        *count = foreign_reply(bytes);
    } else if (kind == FRAME_NOISE) {
        *count = 1u + any(300);
        for (size_t n = 0; n < *count; n++) {
            bytes[n] = (uint8_t)any(256);
        }
    }
    *chance = false;
    const size_t whole = kind == FRAME_FOREIGN ? *count - 1u : *count;
    for (size_t n = 4; kind != FRAME_RIGHT && n <= whole; n++) {
        *chance = *chance || ((kind == FRAME_FOREIGN || bytes[0] == US || bytes[0] == 0u) && fits(bytes, n));
    }
    return kind;
}

#endif
